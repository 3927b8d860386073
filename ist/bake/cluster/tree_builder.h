#pragma once

#include "bake/asset/asset_writer.h"
#include "bake/cluster/ball_lanes.h"

namespace ist {

/// Clusters spheres into an implicit 16-wide tree (asset_layout.h, docs/design.md 6). `covers` are
/// the cover radii of disjoint inner spheres; it is empty for matched spheres, which may overlap,
/// and κ is bounded for them. Every ball of the tree contains the spheres below it for certain:
/// radii are rounded up. Deterministic. The set must not be empty.
TreeArrays build_tree(std::span<const Sphere> spheres, std::span<const float> covers,
                      bool swaps = true);

/// The order in which build_tree() puts the spheres.
std::vector<std::uint32_t> sphere_order(std::span<const Sphere> spheres, bool swaps = true);

/// The tree of matched spheres that lie much as others do, one for one, from sphere_order() of
/// those (refined_order()).
TreeArrays build_tree_like(std::span<const Sphere> spheres, std::vector<std::uint32_t> order);

/// The tree whose leaves are the spheres in a given order: lane i is spheres[order[i]].
TreeArrays tree_from_order(std::span<const Sphere> spheres, std::span<const float> covers,
                           std::vector<std::uint32_t> order);

/// The order in which spheres lie in a tree: every 16^(k+1) consecutive ones from the start are a
/// node of level k. Neural gas forms groups of 16, then groups of their balls, and so on up. With
/// `swaps`, near groups of a level then trade members. Deterministic.
std::vector<std::uint32_t> tree_order(std::span<const Ball> spheres, bool swaps,
                                      bool last_stays = false);

/// An order for spheres that lie much as others do, one for one, from tree_order() of those: its
/// groups of 16 trade members, and groups of their balls are formed anew. Sooner than an order of
/// their own, and about as good (docs/tree_builders.md).
std::vector<std::uint32_t> refined_order(std::span<const Ball> spheres,
                                         std::vector<std::uint32_t> order);

}  // namespace ist
