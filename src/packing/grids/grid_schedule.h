#pragma once

#include <ist/bake.h>

#include "packing/grids/grid_layout.h"

namespace ist::packing {

/// The data from which automatic grid sizes are derived.
struct GridFigures {
  double lower[3] = {}, upper[3] = {};  ///< bounds of the solid, unit frame
  double volume = 0;                    ///< unit frame³
  std::size_t triangles = 0;
  std::size_t memory = 0;  ///< bytes that the grids may take
};

/// The two grids of a mode over the rounds (docs/design.md 4.1): levels of one first grid's
/// refinements. The prototype grid's alone decide what is packed, so they depend on mesh and
/// settings only; the distance grid's decide how fast, and also on the memory that is free.
struct GridSchedule {
  GridLayout first;           ///< level 0
  int prototypes = 0;         ///< level of the prototype grid at the start
  int finest_prototypes = 0;  ///< and at the end
  int distances = 0;          ///< level of the distance grid at the start
  int finest_distances = 0;   ///< and at the end
  int rounds_per_level = 2;

  GridLayout level(int l) const {
    GridLayout g = first;
    for (; l > 0; --l) g = refined(g);
    return g;
  }
};

/// Cells on the longest side of a distance grid that suits so many triangles: finer ones are
/// slower.
int distance_resolution(const GridFigures& solid);

/// Throws Error if settings ask for more cells than there can be.
GridSchedule grid_schedule(GridMode mode, const GridSettings& settings, const GridFigures& solid);

}  // namespace ist::packing
