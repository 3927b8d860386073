#pragma once

#include <numbers>

#include "base/host_device.h"

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

}  // namespace ist
