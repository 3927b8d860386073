#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "mesh/connectivity/edge_table.h"

namespace ist {

/// Corners exactly on a line.
bool is_on_a_line(const double* a, const double* b, const double* c);

/// The same of a triangle; repeated corners too.
bool is_degenerate(const std::vector<Eigen::Vector3d>& vertices, const Triangle& triangle);

/// Edges with an odd number of sides: where the surface has a border, whatever its orientation.
std::size_t count_odd_edges(const EdgeTable& edges);

/// Removes triangles with repeated corners, and degenerate ones that hang on a border (two or more
/// of their sides lie on odd edges). Those that close a crack between other triangles stay: without
/// them the surface would be open. Returns those removed, by their indices before, ascending.
/// `edges`: those of the triangles.
std::vector<std::uint32_t> drop_degenerate(const std::vector<Eigen::Vector3d>& vertices,
                                           std::vector<Triangle>& triangles,
                                           const EdgeTable& edges);

/// Replaces triangles with the same three corners by their signed sum (docs/design.md 3.6): copies
/// become one, opposite ones vanish. Where that leaves a border and one copy does not, one copy
/// stays; the choice is made for each edge-connected group of them. `edges`: of the triangles as
/// they come. Returns the number removed.
std::size_t reduce_coincident(std::vector<Triangle>& triangles, const EdgeTable& edges);

}  // namespace ist
