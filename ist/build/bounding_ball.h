#pragma once

#include <span>

namespace ist {

/// A ball in double, unit frame.
struct Ball {
  double x = 0, y = 0, z = 0, r = 0;
};

/// The smallest ball that holds the given balls, to about 1e-9 of its radius. Deterministic; only
/// + − × ÷ sqrt. The set must not be empty.
Ball bounding_ball(std::span<const Ball> balls);

/// Smallest radius about (x, y, z) that holds the ball, before rounding.
double reach(double x, double y, double z, const Ball& ball);

/// A float no smaller than `value` plus a relative margin of 1e-12, which covers the rounding of a
/// radius computed in double. `value` ≥ 0.
float round_up(double value);

}  // namespace ist
