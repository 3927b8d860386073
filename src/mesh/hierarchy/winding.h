#pragma once

#include <array>

#include "mesh/connectivity/item_groups.h"
#include "mesh/geometry/mesh_view.h"
#include "mesh/geometry/ray_crossing.h"

// Winding numbers by rays parallel to x. A ray is treated as if it were moved by an infinitesimal
// amount in z and a larger infinitesimal in y, so that it meets no edge and no vertex; every
// predicate is exact. A closed mesh's crossings then sum to zero on every line, and the winding
// number of a point off the surface is right however close it is.

namespace ist {

/// Winding number of p (unit frame) about a closed mesh.
int winding_number(const MeshView& mesh, const double p[3]);

/// All crossings of the line (·, y, z), sorted by x, +1 first among equals.
void line_crossings(const MeshView& mesh, double y, double z, std::vector<Crossing>& out);

/// [line] The same for many lines (y, z). Needs only the mesh's arrays: building a hierarchy costs
/// more than a few thousand lines. Runs on the caller's TBB threads.
ItemGroups<std::uint32_t, Crossing> line_crossings(const MeshView& mesh,
                                                   const std::vector<std::array<double, 2>>& lines);

// The sum of solid angles of triangles in vectors, the same bits on every instruction set.

inline constexpr std::size_t kWindingPoints = 8;  ///< evaluated together

/// The far-field expansion of a group of triangles.
struct FarTriangles {
  double centre[3] = {};
  double area = 0;
  double reach2 = -1;     ///< beyond this squared distance from the centre the expansion is used
  double dipole[3] = {};  ///< Σ area · normal
  double second[9] = {};  ///< Σ area · normal ⊗ (centroid − centre), rows by the normal's axis
};

using FarChildren = std::array<FarTriangles, kBvhWidth>;

/// The winding numbers of points, unit frame. `far`: [node] expansions of its children. `points`:
/// [axis].
void wind_about(const MeshView& mesh, const FarChildren* far,
                const double points[3][kWindingPoints], double winding[kWindingPoints]);

}  // namespace ist
