#pragma once

#include <ist/mesh.h>
#include <ist/solid.h>

#include "base/stage.h"
#include "mesh/level_set/surface_cells.h"

namespace ist {

/// A mesh in place of a solid.
struct Polygonised {
  /// [u] a closed, oriented surface: every edge is used equally often in both directions
  TriangleMesh mesh;
  /// [u] proven: every point of the mesh is this near to the solid's surface, and the reverse.
  double error = 0;
};

constexpr unsigned kFewestCells = 8, kMostCells = 1024;

/// The surface of a solid as triangles, by dual contouring: a vertex in every cell that the surface
/// crosses, where its tangent planes meet, so that edges and corners stay sharp.
///
/// `cells`: along the longest side of the bounds, [8, 1024]. Time grows with the surface, by the
/// square of it. Same bytes for any number of threads, which are those of the current arena.
///
/// The surface is where signed_distance() is 0. The error is proven from its being 1-Lipschitz and
/// of the right sign alone: where it underestimates distances, as CSG's does, the proof takes
/// longer and the error may come out larger, never too small. Walls of zero inside the solid (two
/// boxes united that share a face) are surface by that measure; the mesh has none there, and the
/// error says how far they are from it.
///
/// Mesh and solid agree about every point further from both surfaces than the error, as far as the
/// mesh does not meet itself.
///
/// Throws Error where no cell sees both sides of the surface, where the solid reaches out of its
/// bounds, where the signed distance is not 1-Lipschitz or not a number, as far as that is met, and
/// if progress cancels (stage "polygonise").
Polygonised polygonise(const Solid& solid, unsigned cells, const ProgressCallback& progress = {});

/// The mesh of mesh_level_set(), without the proof of its distance from the level set, which would
/// take most of the time. Throws Error likewise.
ClosedMesh level_set_surface(const DistanceGrid& distances, const std::string& name);

/// The mesh of a solid from the cells that its surface crosses, all of them listed by Morton code
/// with their loops, and its error. Reports the second 60 % of the work. Throws Error as
/// polygonise().
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
