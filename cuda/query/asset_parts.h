#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <ist/asset_layout.h>
#include <ist/tree_view.h>

#include "cuda/query/batch_arrays.h"

// Host code only.

namespace ist::gpu {

/// What a batch keeps beside an asset's bytes.
struct AssetParts {
  std::vector<NodeSum> sums;  ///< of the matched tree, then of the inner one
  std::vector<DetailRef> levels;
  std::vector<FilledBall> filled;

  /// `bytes`: where the asset is to lie.
  static AssetParts of(const AssetHeader& header, const std::byte* bytes) {
    const auto* const here = reinterpret_cast<const std::byte*>(&header);
    AssetParts parts{node_sums(header.matched_tree, here), detail_refs(header, bytes),
                     filled_balls(header)};
    const std::vector<NodeSum> inner = node_sums(header.inner_tree, here);
    parts.sums.insert(parts.sums.end(), inner.begin(), inner.end());
    return parts;
  }

  /// The asset as a batch finds it, its parts lying where these pointers say. `first_alike`: the
  /// first of the batch's assets that has the same bytes.
  AssetRef ref(const AssetHeader& header, const std::byte* bytes, const NodeSum* at_sums,
               const DetailRef* at_levels, const FilledBall* at_filled,
               std::size_t first_alike) const {
    AssetRef ref = AssetRef::of(header, bytes);
    ref.set_sums(header, at_sums);
    ref.details = asset_details(header, filled);
    ref.details.level = at_levels;
    ref.details.filled = at_filled;
    ref.details.first_alike = static_cast<std::uint32_t>(first_alike);
    return ref;
  }
};

/// The first of the assets that has the bytes of the i-th (are_one_asset(),
/// query/detail/coincident.h).
inline std::size_t first_alike(std::span<const TreeView> assets, std::size_t i) {
  const AssetHeader& of = assets[i].header();
  std::size_t k = 0;
  while (assets[k].header().content_hash != of.content_hash ||
         assets[k].header().file_bytes != of.file_bytes)
    ++k;
  return k;
}

}  // namespace ist::gpu
