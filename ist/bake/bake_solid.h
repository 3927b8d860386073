#pragma once

#include <ist/asset_layout.h>
#include <ist/bake.h>

#include "bake/asset/asset_writer.h"
#include "bake/mesh/kept_mesh.h"
#include "mesh/mesh_solid.h"
#include "packing/backend/solid_backend.h"

namespace ist {

/// bake() of a mesh whose solid, kept mesh and backend are at hand, on the threads of the current
/// arena. The settings have been checked; where they run is the backend's affair.
Asset bake_solid(const ClosedMesh& mesh, const MeshSolid& solid, SharedMesh& kept,
                 SolidBackend& backend, const PackingSettings& settings,
                 const ProgressCallback& progress);

/// The same with mesh and backend as the settings ask for.
Asset bake_solid(const ClosedMesh& mesh, const MeshSolid& solid, const Resolution& resolution,
                 const PackingSettings& settings, const ProgressCallback& progress);

/// Frame, hash and mass of the mesh: all of a header that needs no spheres.
AssetHeader describe_solid(const ClosedMesh& mesh, const MeshSolid& solid);

void describe_mass(const MeshMoments& moments, AssetHeader& header);

/// Box and ball around the mesh, each `beyond` further out, unit frame.
void describe_bounds(const MeshSolid& solid, double beyond, AssetHeader& header);

void keep(const KeptMesh& kept, AssetArrays& arrays);

/// Everything of that asset but its bytes.
AssetArrays bake_arrays(const ClosedMesh& mesh, const MeshSolid& solid, SharedMesh& kept,
                        SolidBackend& backend, const PackingSettings& settings,
                        const ProgressCallback& progress);

}  // namespace ist
