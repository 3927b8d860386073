#pragma once

#include "bake/asset/asset_writer.h"
#include "mesh/mesh_view.h"

namespace ist {

/// Lays out a closed surface as asset_layout.h draws the mesh: blocks of neighbouring triangles in
/// an order whose groups of 16, 256, … are compact, boxes around them, shells and neighbours.
/// Blocks that share a vertex are neighbours, and their triangles belong to one shell.
///
/// `surface`: unit frame; vertices are taken bit for bit, but −0 becomes 0. `header.error` and
/// `header.rounding` are the caller's to set. Same bytes for any number of threads and on any
/// machine.
MeshArrays lay_out_mesh(const MeshView& surface);

}  // namespace ist
