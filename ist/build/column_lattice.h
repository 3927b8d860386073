#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "mesh/mesh_solid.h"

namespace ist {

/// A part of a column that lies inside the solid.
struct ColumnSpan {
  double x0 = 0, x1 = 0;  ///< unit frame, x0 < x1
};

/// A solid cut into columns along x, exact along x and sampled across: column (i, j) stands for
/// `step_y` × `step_z` of cross-section (DESIGN 5, 1). Row j is shifted along y by an irrational
/// part of the step, so that no straight edge of the solid keeps pace with the lattice, and every
/// row still has exactly one column in each step of the box.
struct ColumnLattice {
  Eigen::AlignedBox3d box;        ///< of the solid, unit frame
  double step_y = 0, step_z = 0;  ///< unit frame
  std::uint32_t ny = 0, nz = 0;   ///< columns in a row, rows
  std::vector<std::uint32_t>
      first;  ///< ny · nz + 1: spans of column (i, j) start at first[j ny + i]
  std::vector<ColumnSpan> spans;
  double length = 0;  ///< Σ of the spans' lengths, unit frame

  double volume() const {
    return length * step_y * step_z;
  }  ///< unit frame³, as the columns see it
  double y(std::uint32_t i, std::uint32_t j) const;
  double z(std::uint32_t j) const { return box.min().z() + (j + 0.5) * step_z; }
};

/// Cuts the solid into columns about `step` apart, closer or wider where fewer than `min_columns`
/// or more than `max_columns` would cross it, with at least 16 either way however thin the box.
/// Same bytes for any number of threads.
ColumnLattice cut_columns(const MeshSolid& solid, double step, double min_columns,
                          double max_columns);

}  // namespace ist
