#pragma once

#include <ist/bake.h>

#include "packing/base/certificate.h"

namespace ist::packing {

/// Throws Error, naming the setting, its value and its range, unless every setting is in range.
void check_settings(const PackingSettings& settings);

/// Converts the settings to the unit frame of a solid; `scale`: [u] of one unit-frame unit. Throws
/// Error if the solid has no volume.
PackingLimits packing_limits(const Solid& solid, double scale, const PackingSettings& settings);

/// Sets the progress of a packing; `radius`: of the spheres being inserted, unit frame. The
/// fraction is that of the nearest limit, count or coverage.
void set_progress(Progress& progress, const PackingLimits& limits, std::size_t spheres,
                  double coverage, double radius);

}  // namespace ist::packing
