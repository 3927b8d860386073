#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bake/cluster/bounding_ball.h"

namespace ist {

/// The order in which spheres lie in a tree: every 16^(k+1) consecutive ones from the start are a
/// node of level k. Groups of 16 are formed first, then groups of their balls, and so on up, by
/// neural gas.
/// With `swaps`, near groups of a level then trade members. Deterministic for any
/// number of threads.
std::vector<std::uint32_t> tree_order(std::span<const Ball> spheres, bool swaps);

/// An order for spheres that lie much as others do, one for one, from tree_order() of those: its
/// groups of 16 trade members, and groups of their balls are formed anew. Sooner than an order of
/// their own, and about as good (docs/tree_builders.md).
std::vector<std::uint32_t> refined_order(std::span<const Ball> spheres,
                                         std::vector<std::uint32_t> order);

}  // namespace ist
