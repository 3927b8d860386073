#pragma once

#include "mesh/geometry/ray_crossing.h"
#include "packing/grids/cell_listing.h"

// Exact winding numbers from the distance grid alone. They are constant in a cell that no triangle
// meets, and a walk along x from such a cell to the point passes every triangle between them in the
// cells of its row. Lines and their crossings as in mesh/hierarchy/winding.h.

namespace ist::packing {

IST_HD inline Corners corners_of(const GridScene& scene, std::uint32_t triangle) {
  const std::uint32_t* t = scene.corners + 3 * std::size_t{triangle};
  return {{scene.vertices + 3 * std::size_t{t[0]}, scene.vertices + 3 * std::size_t{t[1]},
           scene.vertices + 3 * std::size_t{t[2]}}};
}

IST_HD inline TriangleCells cells_of(const GridLayout& g, const Corners& t) {
  return TriangleCells(g, t.p[0], t.p[1], t.p[2]);
}

/// The first cell of the row (·, j, k) that lists the triangle, which counts its crossing in this
/// row. kNoCell if none does.
constexpr int kNoCell = -1;
IST_HD inline int first_in_row(const GridLayout& g, const TriangleCells& cells, int j, int k) {
  for (int i = cells.range().lo[0]; i <= cells.range().hi[0]; ++i)
    if (cells.meets(g, i, j, k)) return i;
  return kNoCell;
}

/// A triangle's term of the winding number along the centre line of a row, towards +x.
IST_HD inline int row_crossing(const GridLayout& g, const Corners& t, int j, int k) {
  const double yz[2] = {double{g.low_y(j)} + 0.5 * double{g.size},
                        double{g.low_z(k)} + 0.5 * double{g.size}};
  return -pierced(t, yz);
}

/// A triangle's term of the winding number, on the line through p from −∞ to p.
IST_HD inline int winding_before(const Corners& t, const double p[3]) {
  const int facing = pierced(t, p + 1);
  return facing == 0 || lies_beyond(t, facing, p) ? 0 : -facing;
}

/// True if p is in the solid (winding number ≥ 1). p must be in the grid.
template <class Team>
IST_HD bool inside_solid(const Team& team, const GridScene& scene, Float3 p) {
  const DistanceGrid& grid = scene.grid;
  const GridLayout& g = grid.layout;
  const int j = g.at_y(p.y), k = g.at_z(p.z);
  int i = g.at_x(p.x);
  const std::uint32_t own = grid.word(i, j, k);
  if (own == DistanceGrid::kInactive) return false;  // or covered by a sphere
  const CellRecord record = grid.records[DistanceGrid::slot(own)];
  if (record.triangle_count == 0) return true;
  const double at[3] = {p.x, p.y, p.z};
  int passed = 0;
  for (CellRecord cell = record;;) {
    for (std::uint32_t n = static_cast<std::uint32_t>(team.lane()); n < cell.triangle_count;
         n += Team::kWidth) {
      const Corners t = corners_of(scene, grid.triangle_lists[cell.triangles + n]);
      const int step = winding_before(t, at);
      if (step != 0 && first_in_row(g, cells_of(g, t), j, k) == i) passed += step;
    }
    if (--i < 0) break;
    const std::uint32_t word = grid.word(i, j, k);
    if (word == DistanceGrid::kInactive) break;
    cell = grid.records[DistanceGrid::slot(word)];
    if (cell.triangle_count == 0) break;
  }
  return record.winding + team.sum(passed) >= 1;
}

}  // namespace ist::packing
