#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bake/cluster/bounding_ball.h"

namespace ist {

/// Orders balls so that consecutive groups of 16, of 16², … are compact, by hierarchical batch
/// neural gas: sixteen prototypes a node move to the mean of all balls, weighted by volume
/// (magnification control) and by a kernel over the prototype's rank as seen from the ball, while
/// the kernel narrows; then the balls are shared out evenly among the prototypes, near to near.
/// (Weller, Zachmann: Inner Sphere Trees; Cottrell, Hammer et al.: Batch and median neural gas.)
/// Only the last group may lack balls. `last_stays`: the last ball lacks spheres, so that it stays
/// last.
std::vector<std::uint32_t> neural_gas_order(std::span<const Ball> balls, bool last_stays);

}  // namespace ist
