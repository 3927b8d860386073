#pragma once

#include <ist/asset_layout.h>

#include "mesh/mesh_solid.h"

// What an asset says of its solid as a rigid body.

namespace ist {

/// Volume, centre of mass and inertia.
void describe_mass(const MeshMoments& moments, AssetHeader& header);

/// Box and ball around the mesh, each `beyond` further out, unit frame.
void describe_bounds(const MeshSolid& solid, double beyond, AssetHeader& header);

}  // namespace ist
