#pragma once

#include <ist/mesh.h>
#include <ist/solid.h>

#include "base/stage.h"

namespace ist {

/// Summed in a fixed order.
inline double dot(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// A grid of cubic cells around a solid.
struct CellGrid {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();  ///< [u]
  double edge = 0;                                ///< [u] of a cell
  std::array<std::int32_t, 3> count = {};         ///< cells along x, y, z

  /// [u] of the point `at` cell edges from the lower corner.
  Eigen::Vector3d point(double x, double y, double z) const {
    return {low[0] + edge * x, low[1] + edge * y, low[2] + edge * z};
  }
  double half_diagonal() const { return 0.8660254037844387 * edge; }  ///< [u] rounded up
  /// [u] rounding of a coordinate, and of a distance of such points.
  double rounding() const;
};

/// A cell that the surface may meet. Corner i is at (i & 1, i >> 1 & 1, i >> 2). Edge 4a + b runs
/// along axis a, from the corner whose coordinates along the axes a + 1 and a + 2 are b's bits.
///
/// The surface in a cell is one vertex for each loop of its edges with two signs. Two such edges
/// follow each other if they lie on one face; of four on a face, those that share an inner corner.
/// Neighbours thus agree, and the surface is closed.
struct SurfaceCell {
  std::uint64_t key = 0;  ///< Morton code of `at`; cells are listed by it
  std::array<std::int32_t, 3> at = {};
  std::uint8_t inside = 0;  ///< bit i: the signed distance of corner i is > 0
  std::uint8_t loops = 0;
  std::uint32_t first_vertex = 0;             ///< of the loops' vertices, one after the other
  std::array<std::uint8_t, 12> loop_of = {};  ///< of every edge with two signs

  bool crosses(int edge) const;
};

/// Corners at the ends of an edge of a cell, the one of the smaller coordinate first.
std::array<int, 2> edge_corners(int edge);

/// The grid of `cells` cells along the longest side of the solid's bounds. Its planes do not
/// coincide with those of the box. Throws Error for invalid bounds.
CellGrid grid_around(const Solid& solid, unsigned cells);

/// Every cell that the surface meets, and others near it, by Morton code. Cells are skipped if
/// their middle is further from the surface than from their corners, so the cost is proportional to
/// the surface. `report(level, levels)`: before each level.
std::vector<SurfaceCell> find_surface_cells(const Solid& solid, const CellGrid& grid,
                                            const std::function<void(int, int)>& report);

/// SurfaceCell::key of a cell; coordinates in [0, 2^20].
std::uint64_t morton_code(const std::array<std::int32_t, 3>& at);

/// Numbers the loops of a cell whose `inside` is set.
void find_loops(SurfaceCell& cell);

/// The cell at a place; null if it is not listed.
const SurfaceCell* cell_at(const std::vector<SurfaceCell>& cells,
                           const std::array<std::int32_t, 3>& at);

struct Polygonised {
  /// [u] a closed, oriented surface: every edge is used equally often in both directions
  TriangleMesh mesh;
  /// [u] proven: every point of the mesh is this near to the solid's surface, and vice versa.
  double error = 0;
};

constexpr unsigned kFewestCells = 8, kMostCells = 1024;

/// The surface of a solid as triangles, by dual contouring: one vertex in every cell that the
/// surface crosses, at the intersection of its tangent planes, so that edges and corners stay
/// sharp.
///
/// `cells`: along the longest side of the bounds, [8, 1024]. Time grows with the square of this.
/// Same bytes for any number of threads, which are those of the current arena.
///
/// The surface is the zero set of signed_distance(). The error is proven from the 1-Lipschitz
/// property and the sign alone: if distances are underestimated, as by CSG, the proof takes longer
/// and the error may be larger, never too small. Interior walls where the distance is 0 (the union
/// of two boxes that share a face) count as surface; the mesh has none there, and the error
/// includes the distance to them.
///
/// Mesh and solid agree at every point further from both surfaces than the error, unless the mesh
/// intersects itself.
///
/// Throws Error if no cell sees both sides of the surface, if the solid extends beyond its bounds,
/// if the signed distance is found not to be 1-Lipschitz or not a number, and if progress cancels
/// (stage "polygonise").
Polygonised polygonise(const Solid& solid, unsigned cells, const ProgressCallback& progress = {});

/// The mesh of mesh_level_set(), without the proof of its distance from the level set, which would
/// take most of the time. Throws Error likewise.
ClosedMesh level_set_surface(const DistanceGrid& distances, const std::string& name);

/// The mesh of a solid from the cells that its surface crosses, all of them listed by Morton code
/// with their loops, and its error. Reports the second 60 % of the work. Throws Error like
/// polygonise().
Polygonised dual_mesh(const Solid& solid, const CellGrid& grid, std::vector<SurfaceCell> cells,
                      Stage& stage);

/// The same without the error, which takes most of the time. Numbers the cells' vertices.
TriangleMesh dual_surface(const Solid& solid, const CellGrid& grid, std::vector<SurfaceCell>& cells,
                          Stage& stage);

/// [u] The largest distance of any point of the mesh from the solid's surface.
double mesh_to_surface(const Solid& solid, const CellGrid& grid, const TriangleMesh& mesh);

/// [u] The largest distance of the surface in any listed cell from the mesh that place_vertices()
/// began. Other cells contain no surface.
double surface_to_mesh(const Solid& solid, const CellGrid& grid,
                       const std::vector<SurfaceCell>& cells, const TriangleMesh& mesh);

}  // namespace ist
