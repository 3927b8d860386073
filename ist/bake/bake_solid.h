#pragma once

#include <ist/bake.h>

#include "asset/asset_writer.h"
#include "backend/solid_backend.h"
#include "mesh/mesh_solid.h"

namespace ist {

/// bake() of a mesh whose solid and backend are at hand, on the threads of the current arena. The
/// settings have been checked; where they run is the backend's affair.
Asset bake_solid(const ClosedMesh& mesh, const MeshSolid& solid, SolidBackend& backend,
                 const PackingSettings& settings, const ProgressCallback& progress);

/// Everything of that asset but its bytes.
AssetArrays bake_arrays(const ClosedMesh& mesh, const MeshSolid& solid, SolidBackend& backend,
                        const PackingSettings& settings, const ProgressCallback& progress);

}  // namespace ist
