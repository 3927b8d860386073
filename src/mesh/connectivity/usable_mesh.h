#pragma once

#include <ist/mesh.h>
#include <cmath>

#include "mesh/connectivity/edge_table.h"

namespace ist {

/// Merges vertices with equal coordinates, like weld(), of a mesh that may be invalid. Throws Error
/// for no triangles, indices out of range, coordinates that are not finite, and sizes and offsets
/// that double cannot handle.
void weld_usable(TriangleMesh& mesh, const std::string& name);

Eigen::AlignedBox3d bounds_of(const std::vector<Eigen::Vector3d>& points);

inline Eigen::AlignedBox3d bounds_of(const std::vector<Eigen::Vector3d>& vertices,
                                     const Triangle& t) {
  Eigen::AlignedBox3d box(vertices[t[0]]);
  box.extend(vertices[t[1]]);
  return box.extend(vertices[t[2]]);
}

/// The box around some triangles; unreferenced vertices do not count.
inline Eigen::AlignedBox3d bounds_of(const std::vector<Eigen::Vector3d>& vertices,
                                     const std::vector<Triangle>& triangles) {
  Eigen::AlignedBox3d box;
  for (const Triangle& t : triangles) box.extend(bounds_of(vertices, t));
  return box;
}

inline double area_of(const std::vector<Eigen::Vector3d>& vertices, const Triangle& t) {
  return (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]).norm() / 2;
}

double largest_coordinate(const Eigen::AlignedBox3d& bounds);

inline double spacing_at(double size) { return std::ldexp(1.0, std::ilogb(size) - 52); }

/// close_mesh() for a closed surface whose triangles already face outward: flips none. Shells that
/// face inward are cavities. Does not search for intersections.
ClosedMesh close_oriented(TriangleMesh mesh, const std::string& name);

}  // namespace ist
