#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include <ist/asset_layout.h>
#include <ist/error.h>
#include <ist/gpu_query.h>

#include "cuda/query/make_cuts.h"
#include "cuda/query/make_field_ref.h"
#include "cuda/query/solid_ref.h"

// Host code only.

namespace ist::gpu {

/// The first of the solids that is an asset with these bytes (are_one_asset(),
/// query/detail/coincident.h).
inline std::uint32_t first_alike(std::span<const GpuSolid> solids, const AssetHeader& of) {
  for (std::uint32_t k = 0;; ++k) {
    const auto* const tree = std::get_if<TreeView>(&solids[k]);
    if (tree != nullptr && tree->header().content_hash == of.content_hash &&
        tree->header().file_bytes == of.file_bytes)
      return k;
  }
}

/// Solid i of a batch. `put`: copies an array to where the batch finds it, and returns the place.
///
/// Throws Error for what a batch cannot hold.
template <class Put>
SolidRef solid_ref(std::span<const GpuSolid> solids, std::size_t i, const Put& put) {
  const auto refuse = [i](const char* why) {
    throw Error("GPU: solid " + std::to_string(i) + " is " + why);
  };
  SolidRef ref = {};
  if (const auto* const field = std::get_if<Field>(&solids[i])) {
    if (std::holds_alternative<FunctionField>(*field))
      refuse(
          "a FunctionField, which a GPU cannot call: sample it into a DistanceGridField, or bake "
          "its solid for a MeshField");
    ref.frame = frame_of(*field);
    ref.field = field_ref(*field, put(pointed_to(*field)));
    return ref;
  }
  const TreeView& asset = std::get<TreeView>(solids[i]);
  if (asset.empty()) refuse("an empty asset");
  if (asset.sphere_count() == 0)
    refuse("an asset without spheres: bake it with spheres, or pass it as a MeshField");
  const AssetHeader& header = asset.header();
  const auto* const here = reinterpret_cast<const std::byte*>(&header);
  const std::byte* const bytes = put(std::span(here, header.file_bytes));
  ref.frame = frame_of(header);
  for (const Measure measure : {Measure::matched, Measure::inner}) {
    const TreeHeader& tree = measure == Measure::inner ? header.inner_tree : header.matched_tree;
    const auto k = static_cast<int>(measure);
    ref.tree[k] = TreeRef::of(tree, bytes);
    ref.sums[k] = SumsRef::of(tree, put(node_sums(tree, here)));
    const TreeRegions regions(header, tree);
    ref.cuts[k] = {put(regions.nodes()), put(regions.ranks()), regions.bins(), regions.shift()};
  }
  ref.cover = CoverRef::of(header.inner_tree, bytes);
  const std::vector<FilledBall> filled = filled_balls(header);
  ref.details = asset_details(header, filled);
  ref.details.level = put(detail_refs(header, bytes));
  ref.details.filled = put(filled);
  ref.details.first_alike = first_alike(solids, header);
  return ref;
}

}  // namespace ist::gpu
