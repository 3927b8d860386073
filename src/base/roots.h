#pragma once

#include <cmath>

#include "base/host_device.h"

namespace ist {

/// x^(3/8) from square roots alone, x ≥ 0: the same bits everywhere, as pow() is not.
IST_HD inline double power_three_eighths(double x) {
  const double quarter = std::sqrt(std::sqrt(x));
  return quarter * std::sqrt(quarter);
}

/// Cube root of x ≥ 0 to a few units in the last place, from + − × ÷ alone: the C library's cbrt
/// differs between processors, and radii go into the asset (docs/design.md 3.3).
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
