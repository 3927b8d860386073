#pragma once

#include <cmath>

#include "mesh/host_device.h"

namespace ist::packing {

/// x^(3/8) from square roots alone, x ≥ 0: the same bits everywhere, as pow() is not.
IST_HD inline double power_three_eighths(double x) {
  const double quarter = std::sqrt(std::sqrt(x));
  return quarter * std::sqrt(quarter);
}

}  // namespace ist::packing
