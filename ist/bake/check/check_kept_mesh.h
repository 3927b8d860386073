#pragma once

#include <vector>

#include <ist/bake.h>

#include "bake/check/check_field.h"

namespace ist {

/// The mesh of an asset that has one, against the mesh that was baked and by itself: its triangles
/// or its error, closed, its blocks, neighbours, shells and boxes.
///
/// `closed`: what was baked; `surface`: the same in the unit frame, `frame`.
std::vector<Invariant> check_kept_mesh(const AssetHeader& asset, const ClosedMesh& closed,
                                       const UnitFrame& frame, const CheckSurface& surface,
                                       Bounding bounding);

}  // namespace ist
