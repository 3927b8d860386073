#pragma once

#include <ist/solid.h>

namespace ist {

/// Summed in this order.
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
/// The surface in a cell is one vertex for each loop of its edges of two signs: two such edges
/// follow each other where they lie on one face; of four on a face, those that share an inner
/// corner. Neighbours thus agree, and the surface is closed.
struct SurfaceCell {
  std::uint64_t key = 0;  ///< Morton code of `at`; cells are listed by it
  std::array<std::int32_t, 3> at = {};
  std::uint8_t inside = 0;  ///< bit i: the signed distance of corner i is > 0
  std::uint8_t loops = 0;
  std::uint32_t first_vertex = 0;             ///< of the loops' vertices, one after the other
  std::array<std::uint8_t, 12> loop_of = {};  ///< of every edge of two signs

  bool crosses(int edge) const;
};

/// Corners at the ends of an edge of a cell, the one of the smaller coordinate first.
std::array<int, 2> edge_corners(int edge);

/// The grid of `cells` cells along the longest side of the solid's bounds. Its planes lie off
/// those of the box. Throws Error for bounds that are no box.
CellGrid grid_around(const Solid& solid, unsigned cells);

/// Every cell that the surface meets, and others near it, by Morton code. Cells are left out where
/// a middle is further from the surface than the corners are from it, so that the cost follows the
/// surface. `report(level, levels)`: before each level.
std::vector<SurfaceCell> find_surface_cells(const Solid& solid, const CellGrid& grid,
                                            const std::function<void(int, int)>& report);

/// SurfaceCell::key of a cell; coordinates in [0, 2^20].
std::uint64_t morton_code(const std::array<std::int32_t, 3>& at);

/// Numbers the loops of a cell whose `inside` is set.
void find_loops(SurfaceCell& cell);

/// The cell at a place; null if it is not listed.
const SurfaceCell* cell_at(const std::vector<SurfaceCell>& cells,
                           const std::array<std::int32_t, 3>& at);

}  // namespace ist
