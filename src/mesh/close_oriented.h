#pragma once

#include <string>

#include <ist/mesh.h>

namespace ist {

/// As close_mesh(), of a closed surface whose triangles face outward already: none is turned.
/// Shells that face inward count as cavities.
ClosedMesh close_oriented(TriangleMesh mesh, const std::string& name);

}  // namespace ist
