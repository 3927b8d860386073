#pragma once

#include <span>
#include <vector>

#include "bake/cluster/bounding_ball.h"

namespace ist {

/// κ of every node of a tree: certified upper bounds on how many of its spheres cover one point.
/// `spheres` lie in tree order; `balls[k]` are the balls around each 16^(k+1) consecutive ones.
/// Answers bounds of the same shape as `balls`, then one entry more: {κ of the whole set}.
std::vector<std::vector<float>> overlap_bounds(std::span<const Ball> spheres,
                                               const std::vector<std::vector<Ball>>& balls);

}  // namespace ist
