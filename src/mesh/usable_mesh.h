#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <vector>

#include <ist/mesh.h>

namespace ist {

/// One vertex for equal coordinates, as weld() has it, of a mesh of which nothing is known.
/// Throws Error for no triangles, indices that lead nowhere, coordinates that are not finite, and
/// sizes and offsets that double cannot compute with.
void weld_usable(TriangleMesh& mesh, const std::string& name);

Eigen::AlignedBox3d bounds_of(const std::vector<Eigen::Vector3d>& points);

/// The largest magnitude of a coordinate.
double largest_coordinate(const Eigen::AlignedBox3d& bounds);

/// The spacing of doubles at `size`.
inline double spacing_at(double size) { return std::ldexp(1.0, std::ilogb(size) - 52); }

/// As close_mesh(), of a closed surface whose triangles face outward already: none is turned.
/// Shells that face inward count as cavities. How its triangles meet is not looked for.
ClosedMesh close_oriented(TriangleMesh mesh, const std::string& name);

}  // namespace ist
