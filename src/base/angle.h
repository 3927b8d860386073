#pragma once

#include <cmath>
#include <numbers>

#include "base/host_device.h"

namespace ist {

/// atan2(y, x) [rad] within 1e-15, 0 for the origin. The C library's may differ between processors;
/// this is of + − × ÷ and square roots alone.
IST_HD inline double angle_of(double y, double x) {
  constexpr double kHalfTurn = std::numbers::pi;
  const double ax = x < 0 ? -x : x, ay = y < 0 ? -y : y;
  const bool steep = ay > ax;
  const double larger = steep ? ay : ax;
  if (!(larger > 0)) return 0;
  // The tangent of a quarter of the angle from the nearer axis: at most tan(π/16).
  double t = (steep ? ax : ay) / larger;
  IST_ROLLED
  for (int halving = 0; halving < 2; ++halving) t /= 1 + std::sqrt(1 + t * t);
  const double square = -t * t;
  double sum = 0;
  for (int k = 21; k > 0; k -= 2) sum = sum * square + 1.0 / k;
  double angle = 4 * t * sum;
  if (steep) angle = kHalfTurn / 2 - angle;
  if (x < 0) angle = kHalfTurn - angle;
  return y < 0 ? -angle : angle;
}

}  // namespace ist
