#pragma once

#include "packing/grids/distance_grid.h"

// The discrete distance field (paper §3): Manhattan distances, in cells, to the closest cell with a
// primitive. It is swept over a byte a cell, lines along x, then y, then z, to and fro, and then
// written to the words of the active cells. Inactive cells stop a sweep: beyond them lie cells with
// primitives that are closer.

namespace ist::packing {

constexpr std::uint8_t kFarCell = 254;  ///< so many cells away, or more
constexpr std::uint8_t kInactiveCell = 255;

/// Before the sweeps.
IST_HD inline std::uint8_t start_distance(const CellRecord& record) {
  return record.triangle_count + record.sphere_count > 0 ? 0 : kFarCell;
}

/// Sweeps `count` cells from `first`, `stride` apart.
IST_HD inline void sweep_distances(std::uint8_t* cells, std::int64_t first, std::int64_t stride,
                                   int count) {
  int reach = kFarCell;
  for (int n = 0; n < count; ++n) {
    const int own = cells[first + n * stride];
    reach = reach < kFarCell ? reach + 1 : kFarCell;
    if (own == kInactiveCell) {
      reach = kFarCell;
    } else if (own <= reach) {
      reach = own;
    } else {
      cells[first + n * stride] = static_cast<std::uint8_t>(reach);
    }
  }
}

/// A line of cells along `axis`: the n-th of them.
struct GridLine {
  std::int64_t first, stride;
  int count;
};
IST_HD inline int grid_lines(const GridLayout& g, int axis) {
  return axis == 0 ? g.n[1] * g.n[2] : axis == 1 ? g.n[0] * g.n[2] : g.n[0] * g.n[1];
}
IST_HD inline GridLine grid_line(const GridLayout& g, int axis, int n) {
  const std::int64_t nx = g.n[0], slice = nx * g.n[1];
  if (axis == 0) return {n * nx, 1, g.n[0]};
  if (axis == 1) return {n / g.n[0] * slice + n % g.n[0], nx, g.n[1]};
  return {n, slice, g.n[2]};
}

IST_HD inline void sweep_line(std::uint8_t* cells, const GridLine& line) {
  sweep_distances(cells, line.first, line.stride, line.count);
  sweep_distances(cells, line.first + (line.count - 1) * line.stride, -line.stride, line.count);
}

/// Places of a hash table for so many keys: a power of two, at most half full.
IST_HD inline std::uint64_t hash_size(std::uint64_t keys) {
  std::uint64_t size = 64;
  while (size < 2 * keys) size *= 2;
  return size;
}

/// Does a hash table, of 8 bytes a place, save much over 4 bytes a cell?
IST_HD inline bool hash_pays(std::uint64_t cells, std::uint64_t active) {
  return 4 * hash_size(active) <= cells;
}

}  // namespace ist::packing
