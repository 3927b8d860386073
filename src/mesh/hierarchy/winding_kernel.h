#pragma once

#include <array>
#include <cstddef>

#include "mesh/geometry/mesh_view.h"

// The sum of solid angles of triangles in vectors, the same bits on every instruction set.

namespace ist {

inline constexpr std::size_t kWindingPoints = 8;  ///< asked at once

/// Triangles seen from afar.
struct FarTriangles {
  double centre[3] = {};
  double area = 0;
  double reach2 = -1;     ///< beyond this squared distance of the centre they count together
  double dipole[3] = {};  ///< Σ area · normal
  double second[9] = {};  ///< Σ area · normal ⊗ (centroid − centre), rows by the normal's axis
};

using FarChildren = std::array<FarTriangles, kBvhWidth>;

/// The winding numbers of points, unit frame. `far`: [node] of its children. `points`: [axis].
void wind_about(const MeshView& mesh, const FarChildren* far,
                const double points[3][kWindingPoints], double winding[kWindingPoints]);

}  // namespace ist
