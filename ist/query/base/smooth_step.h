#pragma once

#include <algorithm>

namespace ist {

/// From 0 at t ≤ 0 to 1 at t ≥ 1, with no slope at either end.
inline double smooth_step(double t) noexcept {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

}  // namespace ist
