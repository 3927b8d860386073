#pragma once

#include "mesh/line_lattice.h"

namespace ist {

/// Where a solid is cut into columns along x: column (i, j) stands for `step_y` × `step_z` of
/// cross-section (DESIGN 5, 1). Row j is shifted along y by an irrational part of the step, so that
/// no straight edge of the solid keeps pace with the lattice, and every row still has exactly one
/// column in each step of the box.
struct ColumnPlan {
  LineLattice lines;
  double x0 = 0, x1 = 0;  ///< extent of the solid, unit frame

  double cross_section() const { return lines.step_y * lines.step_z; }  ///< unit frame²
};

}  // namespace ist
