#pragma once

#include <ist/mesh.h>

namespace ist {

/// Makes a mesh with odd edges a closed surface: closes cracks with a growing tolerance up to 1e-5
/// of the diagonal, drops fins and open sheets, caps the holes that are left. Says in the report's
/// notes what it did. What is left is not oriented yet. Throws Error if nothing is left.
TriangleMesh repair(TriangleMesh mesh, const std::string& name, MeshReport& report);

}  // namespace ist
