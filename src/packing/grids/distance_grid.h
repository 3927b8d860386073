#pragma once

#include <ist/types.h>
#include <cstdint>

#include "base/host_device.h"
#include "base/vec3.h"
#include "mesh/geometry/triangle_frame.h"

namespace ist::packing {

// The discrete distance field (paper §3): Manhattan distances, in cells, to the closest cell with a
// primitive. Sweeps compute it in one byte a cell, along x, then y, then z, back and forth; then it
// is written to the words of the active cells. Inactive cells stop a sweep: cells with primitives
// beyond them are not closer.

/// No test decides closer than this to a cell's border, unit frame. It covers the rounding of float
/// coordinates and of float distances (float_distance_error), so listed and searched cells always
/// include the relevant ones.
constexpr float kListMargin = 2e-6f;
constexpr float kSearchMargin = 8e-6f;

/// A box of cubic cells. Cell borders are exact floats (make_grid_layout), at every refinement.
struct GridLayout {
  Float3 origin;
  float size = 1;          ///< edge of a cell, unit frame
  float inverse_size = 1;  ///< rounded
  int n[3] = {1, 1, 1};    ///< cells along x, y, z
  int level = 0;           ///< number of splits in 8

  IST_HD std::uint32_t count() const {
    return static_cast<std::uint32_t>(n[0]) * static_cast<std::uint32_t>(n[1]) *
           static_cast<std::uint32_t>(n[2]);
  }
  IST_HD std::uint32_t id(int i, int j, int k) const {
    return (static_cast<std::uint32_t>(k) * static_cast<std::uint32_t>(n[1]) +
            static_cast<std::uint32_t>(j)) *
               static_cast<std::uint32_t>(n[0]) +
           static_cast<std::uint32_t>(i);
  }
  IST_HD void coordinates(std::uint32_t id, int& i, int& j, int& k) const {
    const auto nx = static_cast<std::uint32_t>(n[0]), ny = static_cast<std::uint32_t>(n[1]);
    i = static_cast<int>(id % nx);
    j = static_cast<int>(id / nx % ny);
    k = static_cast<int>(id / nx / ny);
  }

  IST_HD float low_x(int i) const { return origin.x + static_cast<float>(i) * size; }
  IST_HD float low_y(int j) const { return origin.y + static_cast<float>(j) * size; }
  IST_HD float low_z(int k) const { return origin.z + static_cast<float>(k) * size; }
  IST_HD Float3 low(int i, int j, int k) const { return {low_x(i), low_y(j), low_z(k)}; }

  /// The cell along one axis that contains the coordinate, clamped; off by rounding near a border.
  IST_HD static int along(float x, float from, float inverse_size, int count) {
    const auto i = static_cast<int>((x - from) * inverse_size);
    return i < 0 ? 0 : (i >= count ? count - 1 : i);
  }
  IST_HD int at_x(float x) const { return along(x, origin.x, inverse_size, n[0]); }
  IST_HD int at_y(float y) const { return along(y, origin.y, inverse_size, n[1]); }
  IST_HD int at_z(float z) const { return along(z, origin.z, inverse_size, n[2]); }
};

/// A grid over a box, `start` ≥ 1 cells on its longest side, that can be refined `refinements` ≥ 0
/// times; start · 2^refinements ≤ kMostGridCells.
GridLayout make_grid_layout(const double lower[3], const double upper[3], int start,
                            int refinements);

IST_HD inline GridLayout refined(const GridLayout& g) {
  GridLayout f = g;
  f.size = 0.5f * g.size;
  f.inverse_size = 2 * g.inverse_size;
  f.n[0] = 2 * g.n[0];
  f.n[1] = 2 * g.n[1];
  f.n[2] = 2 * g.n[2];
  f.level = g.level + 1;
  return f;
}

/// A primitive of the surface ∪ spheres: a sphere's index, or kTriangleTag | a triangle's index.
/// Among primitives at the same distance the smallest tag counts as the nearest.
constexpr std::uint32_t kTriangleTag = 0x80000000u;
constexpr std::uint32_t kNoTag = 0xFFFFFFFFu;

/// The record of an *active* cell of the distance grid: the primitives that overlap it.
struct CellRecord {
  std::uint32_t cell = 0;  ///< its id in the layout
  std::uint32_t triangles = 0, triangle_count = 0;
  std::uint32_t spheres = 0, sphere_count = 0;
  std::int32_t winding = 0;  ///< with triangles: of the next cell without any towards −x
};

/// A triangle for the float distance formula, computed in double and rounded once.
struct alignas(64) GridTriangle {
  TriangleFrame<float> frame;
};

IST_HD inline GridTriangle make_grid_triangle(const double* a, const double* b, const double* c) {
  const TriangleFrame<double> exact = make_triangle_frame(a, b, c);
  GridTriangle t;
  for (int k = 0; k < 3; ++k) {
    t.frame.origin[k] = static_cast<float>(exact.origin[k]);
    t.frame.u[k] = static_cast<float>(exact.u[k]);
    t.frame.v[k] = static_cast<float>(exact.v[k]);
    t.frame.n[k] = static_cast<float>(exact.n[k]);
  }
  t.frame.length = static_cast<float>(exact.length);
  t.frame.apex = static_cast<float>(exact.apex);
  t.frame.height = static_cast<float>(exact.height);
  return t;
}

/// The paper's adaptive storage (§4.3), read-only: words for all cells of the grid refer to the
/// records of the active ones, those that are neither outside nor covered by one sphere. A word
/// contains the index of the record and the *discrete distance* (§3): a lower bound, in cells, of
/// the Manhattan distance to the closest cell with a primitive; 255 if it is more. If few cells are
/// active, the words are in a hash table.
struct DistanceGrid {
  static constexpr std::uint32_t kInactive = 0xFFFFFFFFu;
  static constexpr std::uint32_t kSlotMask = 0x00FFFFFFu;
  static constexpr std::uint32_t kMostActive = kSlotMask - 1;
  static constexpr std::uint32_t kEmptyKey = 0xFFFFFFFFu;

  GridLayout layout;
  const std::uint32_t* words = nullptr;  ///< by cell; or, hashed, by index in `keys`
  const std::uint32_t* keys = nullptr;   ///< nullptr: not hashed
  std::uint32_t key_mask = 0;
  const CellRecord* records = nullptr;
  const std::uint32_t* triangle_lists = nullptr;
  const std::uint32_t* sphere_lists = nullptr;

  IST_HD static std::uint32_t slot(std::uint32_t word) { return word & kSlotMask; }
  IST_HD static int distance(std::uint32_t word) { return static_cast<int>(word >> 24); }

  IST_HD static std::uint32_t hashed(std::uint32_t cell) {
    cell ^= cell >> 16;
    cell *= 0x85EBCA6Bu;
    cell ^= cell >> 13;
    return cell;
  }

  IST_HD std::uint32_t word(std::uint32_t cell) const {
    if (keys == nullptr) return words[cell];
    for (std::uint32_t at = hashed(cell) & key_mask;; at = (at + 1) & key_mask) {
      if (keys[at] == cell) return words[at];
      if (keys[at] == kEmptyKey) return kInactive;
    }
  }
  IST_HD std::uint32_t word(int i, int j, int k) const { return word(layout.id(i, j, k)); }
};

/// Everything that the numerics of a round read. Plain pointers: host or device.
struct GridScene {
  DistanceGrid grid;
  const GridTriangle* triangles = nullptr;
  const std::uint32_t* corners = nullptr;  ///< three vertices a triangle
  const double* vertices = nullptr;        ///< exact, unit frame, three coordinates each
  const Sphere* spheres = nullptr;
};

constexpr std::uint8_t kFarCell = 254;  ///< this many cells away, or more
constexpr std::uint8_t kInactiveCell = 255;

/// The distance before the sweeps.
IST_HD inline std::uint8_t start_distance(const CellRecord& record) {
  return record.triangle_count + record.sphere_count > 0 ? 0 : kFarCell;
}

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

/// A line of cells along `axis`, by number.
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

/// Capacity of a hash table for so many keys: a power of two, at most half full.
IST_HD inline std::uint64_t hash_size(std::uint64_t keys) {
  std::uint64_t size = 64;
  while (size < 2 * keys) size *= 2;
  return size;
}

/// True if a hash table, with 8 bytes an entry, is much smaller than 4 bytes a cell.
IST_HD inline bool hash_pays(std::uint64_t cells, std::uint64_t active) {
  return 4 * hash_size(active) <= cells;
}

}  // namespace ist::packing
