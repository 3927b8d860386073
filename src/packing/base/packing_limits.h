#pragma once

#include <cstdint>

namespace ist::packing {

/// Where a packing stops and what it is measured by; unit frame.
struct PackingLimits {
  double volume = 0;           ///< of the solid
  double target_coverage = 1;  ///< of the volume
  double min_radius = 0;
  double epsilon = 0;             ///< 0 = automatic
  std::uint64_t max_spheres = 0;  ///< 0 = no limit
  std::uint64_t seed = 0;
  double length_unit = 1;  ///< [u] of one unit-frame unit, for progress reports
};

}  // namespace ist::packing
