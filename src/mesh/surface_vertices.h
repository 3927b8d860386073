#pragma once

#include <vector>

#include "mesh/surface_cells.h"

namespace ist {

/// The vertices of all cells' loops, [u]: each within its cell, off its walls, where the surface's
/// tangent planes at the loop's edges meet, or on the surface where these are about one plane. Sets
/// SurfaceCell::first_vertex.
std::vector<Eigen::Vector3d> place_vertices(const Solid& solid, const CellGrid& grid,
                                            std::vector<SurfaceCell>& cells);

}  // namespace ist
