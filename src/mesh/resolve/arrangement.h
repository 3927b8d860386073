#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/edge_table.h"
#include "mesh/resolve/exact_points.h"
#include "mesh/resolve/watched_work.h"

namespace ist {

/// A mesh's triangles, cut wherever they meet: pieces that have nothing in common but whole sides
/// and corners.
struct Arrangement {
  ExactPoints points;
  std::vector<Triangle> pieces;       ///< corners by the points' numbers
  std::vector<std::uint32_t> source;  ///< [piece] a triangle of the mesh in whose plane it lies
  std::vector<int> winding_step;      ///< [piece] > 0: of the winding number, to behind it
  std::vector<std::uint32_t> plane;   ///< [triangle] those in one plane that meet have the same
};

/// Triangles on a line are left out, and pieces that others cancel. `pairs`: those that meet.
/// The same for any number of threads. Throws Unresolvable, and as `work` does.
Arrangement arrange(const std::vector<Eigen::Vector3d>& vertices,
                    const std::vector<Triangle>& triangles,
                    std::span<const std::array<std::uint32_t, 2>> pairs, WatchedWork& work);

}  // namespace ist
