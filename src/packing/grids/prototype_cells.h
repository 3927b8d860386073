#pragma once

#include "packing/grids/cell_listing.h"
#include "packing/grids/grid_candidate.h"

namespace ist::packing {

/// True if a cell of the prototype grid may contain anything that is neither outside nor covered,
/// by the distance grid. Both grids refine the same first one.
template <class Team>
IST_HD bool prototype_cell_active(const Team& team, const GridScene& scene,
                                  const GridLayout& prototypes, std::uint32_t cell) {
  const DistanceGrid& grid = scene.grid;
  const GridLayout& g = grid.layout;
  int i = 0, j = 0, k = 0;
  prototypes.coordinates(cell, i, j, k);
  const int finer = g.level - prototypes.level;
  if (finer <= 0) {
    const std::uint32_t word = grid.word(i >> -finer, j >> -finer, k >> -finer);
    if (word == DistanceGrid::kInactive) return false;
    if (finer == 0) return true;
    const CellRecord record = grid.records[DistanceGrid::slot(word)];
    for (std::uint32_t n = 0; n < record.sphere_count; ++n) {
      const Sphere& s = scene.spheres[grid.sphere_lists[record.spheres + n]];
      if (sphere_cell(prototypes, s, i, j, k) == SphereCell::covers) return false;
    }
    return true;
  }
  const int side = 1 << finer, lanes = Team::kWidth;
  for (int n = 0; n < side * side * side; n += lanes) {
    const int at = n + team.lane();
    const bool active =
        at < side * side * side &&
        grid.word((i << finer) + (at & (side - 1)), (j << finer) + (at >> finer & (side - 1)),
                  (k << finer) + (at >> (2 * finer))) != DistanceGrid::kInactive;
    if (team.any(active)) return true;
  }
  return false;
}

/// The cells of a round's prototypes by id: open addressing.
struct CellTable {
  static constexpr std::uint32_t kEmpty = 0xFFFFFFFFu;
  const std::uint32_t* keys = nullptr;
  const std::uint32_t* values = nullptr;
  std::uint32_t mask = 0;

  IST_HD std::uint32_t find(std::uint32_t cell) const {
    for (std::uint32_t at = DistanceGrid::hashed(cell) & mask;; at = (at + 1) & mask) {
      if (keys[at] == cell) return values[at];
      if (keys[at] == kEmpty) return kEmpty;
    }
  }
};

/// The first step of the selection: true if the prototype of a neighbouring cell precedes this one
/// and overlaps it. Most prototypes are eliminated, since their cells contain no Voronoi node
/// (paper, Figure 2).
IST_HD inline bool outdone_by_neighbour(const GridLayout& g, const CellTable& table,
                                        const GridCandidate* candidates, std::uint32_t index) {
  const GridCandidate me = candidates[index];
  int i = 0, j = 0, k = 0;
  g.coordinates(me.cell, i, j, k);
  for (int dk = -1; dk <= 1; ++dk)
    for (int dj = -1; dj <= 1; ++dj)
      for (int di = -1; di <= 1; ++di) {
        const int x = i + di, y = j + dj, z = k + dk;
        if (x < 0 || x >= g.n[0] || y < 0 || y >= g.n[1] || z < 0 || z >= g.n[2]) continue;
        const std::uint32_t other = table.find(g.id(x, y, z));
        if (other == CellTable::kEmpty || other == index) continue;
        const GridCandidate& c = candidates[other];
        if (c.radius > 0 && goes_before(c, me) && overlap(c, me)) return true;
      }
  return false;
}

}  // namespace ist::packing
