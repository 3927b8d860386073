#pragma once

#include "base/elementary.h"

namespace ist {

/// Upper bound of the protrusion of a ball of radius `r` from a solid, rounding included, negative
/// if it lies inside; `distance`: from its centre to the surface. Unit frame.
IST_HD inline double protrusion_of(double r, double distance, bool centre_inside) {
  return r + (centre_inside ? -distance : distance) + kDistanceMargin;
}

}  // namespace ist
