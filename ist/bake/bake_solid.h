#pragma once

#include <ist/asset_layout.h>
#include <ist/bake.h>

#include "bake/asset/asset_writer.h"
#include "bake/mesh/kept_mesh.h"
#include "mesh/mesh_solid.h"
#include "packing/backend/solid_backend.h"

namespace ist {

/// bake() of a mesh with its solid, kept mesh and backend, on the threads of the current arena. The
/// settings have been validated; the backend determines where they run.
Asset bake_solid(const ClosedMesh& mesh, const MeshSolid& solid, SharedMesh& kept,
                 SolidBackend& backend, const PackingSettings& settings,
                 const ProgressCallback& progress);

/// The same with the mesh and backend that the settings request.
Asset bake_solid(const ClosedMesh& mesh, const MeshSolid& solid, const Resolution& resolution,
                 const PackingSettings& settings, const ProgressCallback& progress);

/// Frame, hash and mass of the mesh: the part of a header that needs no spheres.
AssetHeader describe_solid(const ClosedMesh& mesh, const MeshSolid& solid);

void describe_mass(const MeshMoments& moments, AssetHeader& header);

/// Box and ball around the mesh, each enlarged by `beyond`, unit frame.
void describe_bounds(const MeshSolid& solid, double beyond, AssetHeader& header);

void keep(const KeptMesh& kept, AssetArrays& arrays);

/// The contents of that asset before serialisation.
AssetArrays bake_arrays(const ClosedMesh& mesh, const MeshSolid& solid, SharedMesh& kept,
                        SolidBackend& backend, const PackingSettings& settings,
                        const ProgressCallback& progress);

}  // namespace ist
