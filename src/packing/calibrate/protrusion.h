#pragma once

#include "numerics/host_device.h"

namespace ist {

/// Distance by which a ball of radius `r` sticks out of a solid at most, rounding included,
/// negative if it lies inside; `distance`: from its centre to the surface. Unit frame.
IST_HD inline double protrusion_of(double r, double distance, bool centre_inside) {
  constexpr double kMargin = 1e-12;  // above the rounding of any distance here
  return r + (centre_inside ? -distance : distance) + kMargin;
}

}  // namespace ist
