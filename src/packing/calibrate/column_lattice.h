#pragma once

#include "mesh/mesh_solid.h"
#include "packing/backend/tasks.h"
#include "packing/calibrate/power_grid.h"

namespace ist {

/// Plans columns about `step` apart, closer or wider if fewer than `min_columns` or more than
/// `max_columns` would cross the solid, and at least 16 in both directions however thin the box.
/// Same bytes for any number of threads.
ColumnPlan plan_columns(const MeshSolid& solid, double step, double min_columns,
                        double max_columns);

/// A solid cut into columns, exact along x and sampled across.
struct ColumnLattice : ColumnPlan {
  std::vector<std::uint32_t> first;  ///< lines + 1: spans of column (i, j) start at first[j ny + i]
  std::vector<ColumnSpan> spans;
  double length = 0;  ///< Σ of the spans' lengths, unit frame

  double volume() const { return length * cross_section(); }  ///< unit frame³, by columns
  double y(std::uint32_t i, std::uint32_t j) const { return lines.y(i, j); }
  double z(std::uint32_t j) const { return lines.z(j); }
};

/// Cuts the solid. Same bytes for any number of threads.
ColumnLattice cut_columns(const MeshSolid& solid, const ColumnPlan& plan);

}  // namespace ist
