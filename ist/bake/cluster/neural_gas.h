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
/// Groups are as full as in two_means_order, whose `last_stays` this has too.
std::vector<std::uint32_t> neural_gas_order(std::span<const Ball> balls, bool last_stays);

}  // namespace ist
