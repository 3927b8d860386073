#pragma once

#include <vector>

#include "base/stage.h"
#include "mesh/level_set/polygonise.h"
#include "mesh/level_set/surface_cells.h"

namespace ist {

/// The mesh of a solid from the cells that its surface crosses, all of them listed by Morton code
/// with their loops, and its error. Tells `stage` of the second 60 % of the work. Throws Error as
/// polygonise() does.
Polygonised dual_mesh(const Solid& solid, const CellGrid& grid, std::vector<SurfaceCell> cells,
                      Stage& stage);

/// The same without the error, which takes most of the time. Numbers the cells' vertices.
TriangleMesh dual_surface(const Solid& solid, const CellGrid& grid, std::vector<SurfaceCell>& cells,
                          Stage& stage);

/// [u] how far a triangle of the mesh is from the solid's surface anywhere: the largest over all.
double mesh_to_surface(const Solid& solid, const CellGrid& grid, const TriangleMesh& mesh);

/// [u] how far the surface is from the mesh that place_vertices() began, anywhere: the largest over
/// all listed cells. In others there is none.
double surface_to_mesh(const Solid& solid, const CellGrid& grid,
                       const std::vector<SurfaceCell>& cells, const TriangleMesh& mesh);

}  // namespace ist
