#pragma once

#include "base/host_device.h"

namespace ist {

/// Rises from 0 at t ≤ 0 to 1 at t ≥ 1 with slope 0 at both ends.
IST_HD inline double smooth_step(double t) noexcept {
  t = t < 0 ? 0 : t > 1 ? 1 : t;
  return t * t * (3 - 2 * t);
}

/// Its slope, 0 ≤ t ≤ 1.
IST_HD inline double smooth_slope(double t) noexcept { return 6 * t * (1 - t); }

}  // namespace ist
