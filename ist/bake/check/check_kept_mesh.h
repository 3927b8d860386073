#pragma once

#include <ist/asset_layout.h>
#include <ist/bake.h>

#include <vector>

#include "bake/check/checked_mesh.h"

namespace ist {

/// The mesh of an asset that has one, against the mesh that was baked and by itself: its triangles
/// and errors, closed, its blocks, neighbours, shells and boxes.
///
/// `baked`: what was baked, or made in the solid's place; `checked`: the same in the unit frame,
/// `frame`.
std::vector<Invariant> check_kept_mesh(const AssetHeader& asset, const ClosedMesh& baked,
                                       const UnitFrame& frame, const CheckedMesh& checked);

}  // namespace ist
