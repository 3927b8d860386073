#pragma once

#include <numbers>

#include "base/elementary.h"
#include "packing/backend/tasks.h"
#include "packing/calibrate/power_grid.h"

// Relaxation of power cells (docs/design.md 5, 3), shared by host and device.

namespace ist {

constexpr int kRelaxations = 16;

/// The octree over a solid's columns without its flags and pointers, which the caller sets.
/// `length`: Σ of the columns' lengths.
PowerGrid plan_power_grid(const ColumnPlan& plan, double length);

/// True if columns that cover so much of a volume can divide it: those of a slanted sliver cannot.
IST_HD inline bool columns_measure(double seen, double volume) {
  constexpr double kLargestMiss = 0.1;
  const double miss = seen > volume ? seen - volume : volume - seen;
  return seen > 0 && miss <= kLargestMiss * volume;
}

IST_HD inline double radius_of(double volume) {
  return cube_root(3 * volume / (4 * std::numbers::pi));
}

/// Part of the solid's volume in a cell, [0, 1]; `total`: the length of all cells.
IST_HD inline double share_of(const PowerSums& sums, std::int64_t total) {
  return sums.length > 0 ? static_cast<double>(sums.length) / static_cast<double>(total) : 0;
}

/// Moves a site to its cell's centre of mass and gives it the cell's volume as a ball. The site of
/// an empty cell stays, and may win some volume back.
IST_HD inline void relax(PowerSite& site, const PowerSums& sums, std::int64_t total,
                         double volume) {
  const double share = share_of(sums, total);
  if (!(share > 0)) return;
  const double length = static_cast<double>(sums.length);
  const double radius = radius_of(share * volume);
  site = {static_cast<double>(sums.x) / length, static_cast<double>(sums.y) / length,
          static_cast<double>(sums.z) / length, radius * radius};
}

}  // namespace ist
