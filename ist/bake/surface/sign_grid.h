#pragma once

#include <cstddef>

#include "bake/asset/asset_writer.h"
#include "mesh/mesh_view.h"

namespace ist {

/// Lays a grid over the blocks of a surface: which triangles a cell holds, and whether its
/// reference point is inside. Fills the header's grid, the bricks and the cells, which are as fine
/// as `bytes` for all that allows: short lists are looked through fast.
///
/// Inside is where the winding number about the surface is odd: it is 0 or 1, but within the
/// surface's error of it.
/// `surface`: the same triangles, with a hierarchy. Deterministic.
void lay_sign_grid(const MeshView& surface, std::size_t bytes, SurfaceArrays& arrays);

}  // namespace ist
