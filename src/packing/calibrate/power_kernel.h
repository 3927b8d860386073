#pragma once

#include <cstddef>

#include "packing/calibrate/power_grid.h"

// The host's vectors over the sites of a cell: the arithmetic of PowerFilter and walk_column, with
// the same bits on every instruction set.

namespace ist {

inline constexpr std::size_t kMostPowerLanes = 8;  ///< of a vector

/// Sites in arrays that may be read, and written, kMostPowerLanes elements beyond their end.
struct SiteArrays {
  double* x;
  double* y;
  double* z;
  double* weight;
  std::uint32_t* number;  ///< of the site; ascending

  SiteArrays from(std::size_t first) const {
    return {x + first, y + first, z + first, weight + first, number + first};
  }
};

/// Copies those of `count` sites that may own a part of the cell to `kept`, which may directly
/// follow them; returns their number. `powers`: count + kMostPowerLanes elements.
std::size_t keep_sites(const PowerBox& box, const SiteArrays& sites, std::size_t count,
                       const SiteArrays& kept, double* powers);

/// Cuts the cell's columns at 1 to kPowerLeafSites power cells; adds to sums[number].
void walk_cell(const PowerGrid& grid, const PowerGridCell& cell, const SiteArrays& sites,
               std::size_t count, PowerSums* sums);

}  // namespace ist
