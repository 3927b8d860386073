#pragma once

#include <cmath>
#include <numbers>

#include "base/bits.h"
#include "base/host_device.h"

namespace ist {

/// Rises from 0 at t ≤ 0 to 1 at t ≥ 1 with slope 0 at both ends.
IST_HD inline double smooth_step(double t) noexcept {
  t = t < 0 ? 0 : t > 1 ? 1 : t;
  return t * t * (3 - 2 * t);
}

/// The slope of smooth_step(), 0 ≤ t ≤ 1.
IST_HD inline double smooth_slope(double t) noexcept { return 6 * t * (1 - t); }

// Conversions from double to float with directed rounding, the same bits on host and device.

/// Exceeds the rounding of any distance in the unit frame, in double.
constexpr double kDistanceMargin = 1e-12;

/// Largest float not above x.
IST_HD inline float rounded_down(double x) {
  const auto nearest = static_cast<float>(x);
  if (!(double{nearest} > x)) return nearest;
  return nearest == 0 ? -0x1p-149f : from_ordered_bits(ordered_bits(nearest) - 1u);
}

/// Smallest float not below x.
IST_HD inline float rounded_up(double x) { return -rounded_down(-x); }

/// A float no smaller than x ≥ 0 plus a relative margin of 1e-12, which covers the rounding of a
/// length computed in double.
inline float padded_up(double x) { return rounded_up(x + x * 1e-12); }

/// atan2(y, x) [rad] within 1e-15, 0 for the origin. The C library's may differ between processors;
/// this uses only + − × ÷ and square roots.
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

/// x^(3/8) from square roots alone, x ≥ 0: the same bits everywhere, unlike pow().
IST_HD inline double power_three_eighths(double x) {
  const double quarter = std::sqrt(std::sqrt(x));
  return quarter * std::sqrt(quarter);
}

/// Cube root of x ≥ 0 to a few units in the last place, from + − × ÷ alone: the C library's cbrt
/// differs between processors, and the asset stores radii (docs/design.md 3.3).
IST_HD inline double cube_root(double x) {
  if (!(x > 0 && x < HUGE_VAL)) return x > 0 ? x : 0;
  double scale = 1;  // x in [1/8, 1) by powers of 8, exact
  while (x >= 1) {
    x *= 0.125;
    scale *= 2;
  }
  while (x < 0.125) {
    x *= 8;
    scale *= 0.5;
  }
  double y = 0.4 + 0.6 * x;  // within 15 %; five Newton steps double the digits each
  for (int k = 0; k < 5; ++k) y = (2 * y + x / (y * y)) / 3;
  return y * scale;
}

}  // namespace ist
