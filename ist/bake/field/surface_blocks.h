#pragma once

#include <cstdint>
#include <vector>

#include "bake/asset/asset_writer.h"
#include "bake/field/field_mesh.h"

namespace ist {

/// Cuts the surface into blocks of neighbouring triangles and puts balls around the blocks, level
/// by level: `blocks` and `levels` of the arrays. Every ball holds the triangles below it for
/// certain. The mesh must have a triangle.
void cut_into_blocks(const FieldMesh& mesh, FieldArrays& arrays);

}  // namespace ist
