#pragma once

#include <cmath>
#include <numbers>

#include "numerics/host_device.h"

// Arithmetic on plain numbers, for host and device code.

namespace ist {

// std::min, std::max and std::clamp, which the device does not have.
IST_HD inline double least(double x, double y) { return x < y ? x : y; }
IST_HD inline double most(double x, double y) { return x > y ? x : y; }
IST_HD inline double clamped(double x, double low, double high) {
  return x < low ? low : high < x ? high : x;
}

inline constexpr double kBallVolume = 4 * std::numbers::pi / 3;
IST_HD inline double ball_volume(double r) { return kBallVolume * (r * r * r); }

// Sums of three products are in this order everywhere.
IST_HD inline double dot(const double (&a)[3], const double (&b)[3]) {
  return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2];
}
IST_HD inline double norm(const double (&a)[3]) { return std::sqrt(dot(a, a)); }
IST_HD inline void cross(const double (&a)[3], const double (&b)[3], double (&out)[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

}  // namespace ist
