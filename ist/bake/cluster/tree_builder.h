#pragma once

#include "bake/asset/asset_writer.h"
#include "bake/cluster/ball_lanes.h"

namespace ist {

/// Clusters spheres into an implicit 16-wide tree (asset_layout.h, docs/design.md 6). `covers` are
/// the cover radii of disjoint inner spheres; it is empty for matched spheres, which may overlap
/// and whose κ is bounded. Every ball of the tree certainly contains the spheres below it: radii
/// are rounded up. Deterministic. The set must not be empty.
TreeArrays build_tree(std::span<const Sphere> spheres, std::span<const float> covers,
                      bool swaps = true);

/// The order of spheres in build_tree().
std::vector<std::uint32_t> sphere_order(std::span<const Sphere> spheres, bool swaps = true);

/// The tree of matched spheres that are close to others, one for one, from the sphere_order() of
/// those (refined_order()).
TreeArrays build_tree_like(std::span<const Sphere> spheres, std::vector<std::uint32_t> order);

/// The tree whose leaves are the spheres in a given order: lane i is spheres[order[i]].
TreeArrays tree_from_order(std::span<const Sphere> spheres, std::span<const float> covers,
                           std::vector<std::uint32_t> order);

/// The order of spheres in a tree: every 16^(k+1) consecutive ones from the start form a node of
/// level k. Neural gas forms groups of 16, then groups of their balls, and so on. With `swaps`,
/// neighbouring groups of a level then exchange members. Deterministic.
std::vector<std::uint32_t> tree_order(std::span<const Ball> spheres, bool swaps,
                                      bool last_stays = false);

/// An order for spheres that are close to others, one for one, from the tree_order() of those: its
/// groups of 16 exchange members, and groups of their balls are formed again. Faster than a new
/// order, and about as good (docs/tree_builders.md).
std::vector<std::uint32_t> refined_order(std::span<const Ball> spheres,
                                         std::vector<std::uint32_t> order);

}  // namespace ist
