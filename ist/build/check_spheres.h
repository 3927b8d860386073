#pragma once

#include <utility>
#include <vector>

#include <ist/bake.h>

#include "build/check_surface.h"
#include "mesh/mesh_solid.h"
#include "query/asset_layout.h"

namespace ist {

/// Inner spheres lie in the solid and apart; effective spheres stand for it; covers hold spheres.
std::vector<Invariant> check_spheres(const AssetHeader& asset, const CheckSurface& surface);

/// The header's frame and volumes are those of the mesh.
std::vector<Invariant> check_header(const AssetHeader& asset, const CheckSurface& surface,
                                    const MeshSolid& solid);

/// Every point of the solid lies in some cover ball: proven by subdivision.
Invariant check_cover(const AssetHeader& asset, const CheckSurface& surface);

/// For every sphere, the others that it overlaps.
std::vector<std::vector<std::uint32_t>> overlapping_pairs(const Sphere4* spheres,
                                                          std::size_t count);

}  // namespace ist
