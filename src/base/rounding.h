#pragma once

#include "base/bits.h"

// From double to float on a chosen side, the same bits on host and device.

namespace ist {

/// Above the rounding of any distance in the unit frame, in double.
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

}  // namespace ist
