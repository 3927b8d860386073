#pragma once

#include "mesh/surface_cells.h"

namespace ist {

/// [u] how far a triangle of the mesh is from the solid's surface anywhere: the largest over all.
double mesh_to_surface(const Solid& solid, const CellGrid& grid, const TriangleMesh& mesh);

/// [u] how far the surface is from the mesh that place_vertices() began, anywhere: the largest over
/// all listed cells. In others there is none.
double surface_to_mesh(const Solid& solid, const CellGrid& grid,
                       const std::vector<SurfaceCell>& cells, const TriangleMesh& mesh);

}  // namespace ist
