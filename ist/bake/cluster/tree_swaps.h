#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bake/cluster/bounding_ball.h"

namespace ist {

/// Swaps balls between near groups of 16 consecutive entries of `order` while that shrinks
/// Σ (R + s)³ over the groups' bounding balls; s stands for what a query brings along. The last
/// entry keeps its place if `last_stays`. Deterministic for any number of threads.
void improve_groups(std::span<const Ball> balls, bool last_stays,
                    std::vector<std::uint32_t>& order);

}  // namespace ist
