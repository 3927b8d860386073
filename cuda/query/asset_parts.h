#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ist/asset_layout.h>
#include <ist/tree_view.h>

#include "cuda/query/batch_arrays.h"
#include "cuda/query/make_cuts.h"

// Host code only.

namespace ist::gpu {

/// Where an asset's parts lie for who works on the batch.
struct PartPlaces {
  const NodeSum* sums;
  const DetailRef* levels;
  const FilledBall* filled;
  const CutNode* cuts;
  const std::uint16_t* ranks;
};

/// What a batch keeps beside an asset's bytes.
struct AssetParts {
  // Of the matched tree, then of the inner one.
  std::vector<NodeSum> sums;
  std::vector<CutNode> cuts;
  std::vector<std::uint16_t> ranks;  ///< of bins
  CutsRef cuts_of[2];                ///< without places
  std::vector<DetailRef> levels;
  std::vector<FilledBall> filled;

  /// `bytes`: where the asset is to lie.
  static AssetParts of(const AssetHeader& header, const std::byte* bytes) {
    const auto* const here = reinterpret_cast<const std::byte*>(&header);
    AssetParts parts;
    parts.levels = detail_refs(header, bytes);
    parts.filled = filled_balls(header);
    for (const Measure measure : {Measure::matched, Measure::inner}) {
      const TreeHeader& tree = measure == Measure::inner ? header.inner_tree : header.matched_tree;
      append(node_sums(tree, here), parts.sums);
      const TreeRegions regions(header, tree);
      parts.cuts_of[static_cast<int>(measure)] = {nullptr, nullptr, regions.bins(),
                                                  regions.shift()};
      append(regions.nodes(), parts.cuts);
      append(regions.ranks(), parts.ranks);
    }
    return parts;
  }

  std::uint32_t most_bins() const { return std::max(cuts_of[0].bins, cuts_of[1].bins); }

  /// The asset as a batch finds it. `first_alike`: the first of the batch's assets that has the
  /// same bytes.
  AssetRef ref(const AssetHeader& header, const std::byte* bytes, const PartPlaces& at,
               std::size_t first_alike) const {
    AssetRef ref = AssetRef::of(header, bytes);
    ref.set_sums(header, at.sums);
    ref.details = asset_details(header, filled);
    ref.details.level = at.levels;
    ref.details.filled = at.filled;
    PartPlaces left = at;
    for (const Measure measure : {Measure::matched, Measure::inner}) {
      CutsRef& of = ref.cuts[static_cast<int>(measure)] = cuts_of[static_cast<int>(measure)];
      of.node = left.cuts;
      of.rank = left.ranks;
      left.cuts += 2 * of.bins - 1;
      left.ranks += of.bins;
    }
    ref.details.first_alike = static_cast<std::uint32_t>(first_alike);
    return ref;
  }

 private:
  template <class T>
  static void append(const std::vector<T>& from, std::vector<T>& to) {
    to.insert(to.end(), from.begin(), from.end());
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
