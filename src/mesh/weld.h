#pragma once

#include <vector>

#include <ist/mesh.h>

namespace ist {

/// One vertex for all that lie within `tolerance` [u] of the first of them in file order (0: equal
/// coordinates, −0 = 0); triangles follow. Unreferenced vertices are dropped, the rest keep their
/// order. Every referenced coordinate must be finite.
TriangleMesh weld(TriangleMesh mesh, double tolerance);

/// Of these the last step alone: unreferenced vertices are dropped.
void drop_unused(TriangleMesh& mesh);

/// As weld() with a tolerance above 0, but vertices that are not in `among` (by index) stay apart.
TriangleMesh weld_among(const TriangleMesh& mesh, double tolerance, const std::vector<bool>& among);

}  // namespace ist
