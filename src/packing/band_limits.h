#pragma once

#include <ist/packing.h>

#include "packing/band_schedule.h"

namespace ist::packing {

/// Where a packing of `solid` stops. `scale`: [u] of one unit-frame unit.
inline BandLimits band_limits(const Solid& solid, double scale, const PackingSettings& settings) {
  BandLimits limits;
  limits.volume = solid.volume() / scale / scale / scale;
  limits.target_coverage = settings.target_coverage;
  limits.min_radius = settings.min_radius / scale;
  limits.epsilon = settings.epsilon;
  limits.max_spheres = settings.max_spheres;
  limits.seed = settings.seed;
  return limits;
}

}  // namespace ist::packing
