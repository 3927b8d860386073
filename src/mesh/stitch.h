#pragma once

#include <ist/mesh.h>

namespace ist {

/// Closes cracks: joins border vertices that lie within `tolerance` [u] of each other, and splits
/// border triangles where a border vertex lies within it of their side (T-junctions). Interior
/// vertices stay. Border: edges with an odd number of sides.
TriangleMesh stitch(const TriangleMesh& mesh, double tolerance);

}  // namespace ist
