#pragma once

#include <ist/packing.h>

#include "packing/grids/grid_backend.h"
#include "packing/grids/grid_schedule.h"

namespace ist::packing {

/// Where a grid packing stops; unit frame.
struct GridLimits {
  double volume = 0;
  double target_coverage = 1;
  double min_radius = 0;
  double length_unit = 1;  ///< [u] of one unit-frame unit, for progress reports
};

/// A round, for whoever wants the history.
struct GridRound {
  double seconds = 0;  ///< since the start, at the end of the round
  std::size_t spheres = 0;
  double coverage = 0;
  double radius = 0;  ///< largest inserted in the round, unit frame; 0: none
  int prototype_level = 0, distance_level = 0;
  GridUse use;
};

/// The paper's algorithm (§3, §4; DESIGN 4.1), the same for all four schedules and on any backend.
SpherePacking pack_on_grids(GridBackend& backend, const GridSchedule& schedule,
                            const GridLimits& limits, const PackingSettings& settings,
                            const ProgressCallback& progress,
                            std::vector<GridRound>* history = nullptr);

}  // namespace ist::packing
