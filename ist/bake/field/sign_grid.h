#pragma once

#include "asset/asset_writer.h"
#include "mesh/mesh_view.h"

namespace ist {

/// Lays a grid over the blocks of a field: which triangles a cell holds, and whether its reference
/// point is inside. Fills the header's grid, the bricks and the cells. About as many cells hold
/// surface as there are triangles.
///
/// Inside is where the winding number about the field's surface is odd: it is 0 or 1, but within
/// the field's error of the surface.
/// `surface`: the same triangles, with a hierarchy. Deterministic.
void lay_sign_grid(const MeshView& surface, FieldArrays& arrays);

}  // namespace ist
