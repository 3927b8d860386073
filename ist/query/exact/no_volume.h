#pragma once

#include <cmath>

#include "base/host_device.h"

namespace ist {

/// True if solids that touch have no volume in common, where the sum may be rounding alone. This is
/// so if it is no thicker than the touching distance, spread over the faces that lie on each other
/// (`area`) or push (no more than `push`); if the pushing faces are at most a strip as wide along
/// the smaller solid (`extent`), as where edges or points touch; or if rounding leaves nothing.
IST_HD inline bool has_no_volume(double volume, double push, double area, double touch,
                                 double extent) noexcept {
  return std::abs(volume) <= 8 * touch * (area + push) || push <= 8 * touch * extent ||
         !(volume > 0);
}

}  // namespace ist
