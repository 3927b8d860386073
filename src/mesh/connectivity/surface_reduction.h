#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "mesh/connectivity/edge_table.h"

namespace ist {

/// True if the corners are exactly collinear.
bool is_on_a_line(const double* a, const double* b, const double* c);

/// The same for a triangle; also true for repeated corners.
bool is_degenerate(const std::vector<Eigen::Vector3d>& vertices, const Triangle& triangle);

/// Counts edges with an odd number of sides: borders of the surface, whatever its orientation.
std::size_t count_odd_edges(const EdgeTable& edges);

/// Removes triangles with repeated corners, and degenerate ones on a border (two or more of their
/// sides are on odd edges). Those that close a crack between other triangles stay: without them the
/// surface would be open. Returns the removed ones by their former indices, ascending. `edges`: of
/// the triangles.
std::vector<std::uint32_t> drop_degenerate(const std::vector<Eigen::Vector3d>& vertices,
                                           std::vector<Triangle>& triangles,
                                           const EdgeTable& edges);

/// Replaces triangles with the same three corners by their signed sum (docs/design.md 3.6): copies
/// become one, opposite ones vanish. If that leaves a border and one copy does not, one copy stays;
/// the choice is made for each edge-connected group of them. `edges`: of the triangles before.
/// Returns the number removed.
std::size_t reduce_coincident(std::vector<Triangle>& triangles, const EdgeTable& edges);

}  // namespace ist
