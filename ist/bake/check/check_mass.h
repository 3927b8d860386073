#pragma once

#include <vector>

#include <ist/bake.h>
#include <ist/solid.h>

#include <ist/asset_layout.h>
#include "bake/check/check_surface.h"
#include "mesh/mesh_moments.h"

namespace ist {

/// The header's frame is the mesh's.
Invariant check_frame(const AssetHeader& asset, const UnitFrame& frame);

/// Volume, centre of mass and inertia are `moments`, and about those of the solid, by points.
std::vector<Invariant> check_mass(const AssetHeader& asset, const MeshMoments& moments,
                                  const CheckedSolid& solid);

/// Box and ball hold the surface, and what may be around it where that is a solid's mesh.
std::vector<Invariant> check_bounds(const AssetHeader& asset, const CheckSurface& surface);

}  // namespace ist
