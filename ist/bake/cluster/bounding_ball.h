#pragma once

#include <cmath>
#include <span>
#include <vector>

namespace ist {

/// A ball in double, unit frame.
struct Ball {
  double x = 0, y = 0, z = 0, r = 0;
};

/// The smallest ball that contains the given balls, to about 1e-9 of its radius. Deterministic;
/// only
/// + − × ÷ sqrt. The set must not be empty.
Ball bounding_ball(std::span<const Ball> balls);

/// Smallest radius about (x, y, z) that contains the ball, before rounding.
inline double reach(double x, double y, double z, const Ball& ball) {
  const double dx = ball.x - x;
  const double dy = ball.y - y;
  const double dz = ball.z - z;
  return std::sqrt(dx * dx + dy * dy + dz * dz) + ball.r;
}

/// κ of every node of a tree: certified upper bounds on how many of its spheres cover one point.
/// `spheres` lie in tree order; `balls[k]` are the balls around each 16^(k+1) consecutive ones.
/// Answers bounds of the same shape as `balls`, then one entry more: {κ of the whole set}.
std::vector<std::vector<float>> overlap_bounds(std::span<const Ball> spheres,
                                               const std::vector<std::vector<Ball>>& balls);

}  // namespace ist
