#pragma once

#include <ist/types.h>

#include "base/vec3.h"

namespace ist::packing {

/// A grid of spheres: cubes of the unit frame with lists. A sphere is listed where its surface is
/// within `reach`, so the one cell that contains a point lists everything within `reach` of it.
/// Cells come in blocks of 8³. A cell wholly inside a sphere lists that sphere alone (there is at
/// most one: spheres do not overlap). The list of a cell is a set and a function of layout and
/// spheres.
struct SphereGridLayout {
  float reach = 2;     ///< > 0, unit frame
  float size = 0.25f;  ///< edge of a cell
  float inverse_size = 4;
  int blocks_per_side = 1;
  int cells_per_side = 8;

  static constexpr std::uint32_t kCellsPerBlock = 512;

  IST_HD std::uint32_t block_count() const { return block_index(0, 0, blocks_per_side); }
  IST_HD std::uint32_t block_index(int i, int j, int k) const {
    return static_cast<std::uint32_t>((k * blocks_per_side + j) * blocks_per_side + i);
  }
  /// Index of the grid's cell (i, j, k) in its block.
  IST_HD static std::uint32_t cell_index(int i, int j, int k) {
    return static_cast<std::uint32_t>(((k & 7) * 8 + (j & 7)) * 8 + (i & 7));
  }
};

constexpr float kGridHalfExtent = 1;
constexpr int kMostBlocksPerSide = 128;

/// Cells of about the reach, so that lists are short, but no more cells than the spheres justify (a
/// single large sphere would be listed in millions). `spheres`: their number at construction.
IST_HD inline SphereGridLayout sphere_grid_layout(std::uint64_t spheres, float reach) {
  SphereGridLayout layout;
  layout.reach = reach;
  const float wanted = 2 * kGridHalfExtent / reach / 8;
  int side = wanted < kMostBlocksPerSide - 1 ? static_cast<int>(wanted) + 1 : kMostBlocksPerSide;
  const std::uint64_t most = 27 * (spheres > 0 ? spheres : 1);
  while (static_cast<std::uint64_t>(side) * static_cast<std::uint64_t>(side) *
             static_cast<std::uint64_t>(side) >
         most)
    --side;
  layout.blocks_per_side = side;
  layout.cells_per_side = 8 * side;
  layout.size = 2 * kGridHalfExtent / static_cast<float>(layout.cells_per_side);
  layout.inverse_size = 1 / layout.size;
  return layout;
}

/// The coordinate of the cell that contains x, or of the nearest cell; |x| < 2^20.
IST_HD inline int grid_coordinate(const SphereGridLayout& layout, float x) {
  const int i = static_cast<int>((x + kGridHalfExtent) * layout.inverse_size);
  return i < 0 ? 0 : (i >= layout.cells_per_side ? layout.cells_per_side - 1 : i);
}

/// The cells that may list a sphere, ends included.
struct GridRange {
  int lo[3], hi[3];
};

// Margins cover rounding here and in grid_coordinate(): listing a sphere too often is harmless.
IST_HD inline float listed_radius(const SphereGridLayout& layout, const Sphere& s) {
  return (s.r + layout.reach) * 1.0001f + 1e-6f;
}

IST_HD inline GridRange grid_range(const SphereGridLayout& layout, const Sphere& s) {
  const float outer = listed_radius(layout, s);
  return {{grid_coordinate(layout, s.x - outer), grid_coordinate(layout, s.y - outer),
           grid_coordinate(layout, s.z - outer)},
          {grid_coordinate(layout, s.x + outer), grid_coordinate(layout, s.y + outer),
           grid_coordinate(layout, s.z + outer)}};
}

/// The relation of a sphere to a cell or a block.
enum class GridRelation : std::uint8_t {
  away,    ///< not listed
  near,    ///< listed, unless another sphere covers it
  covers,  ///< the only one listed
};

/// Nearest and farthest distance² along one axis from a centre to `width` cells from `cell` on.
struct AxisSpan {
  float near2, far2;
};
IST_HD inline AxisSpan axis_span(const SphereGridLayout& layout, int cell, int width,
                                 float centre) {
  const float slack = 1e-6f;
  const float from = static_cast<float>(cell) * layout.size - kGridHalfExtent - centre;
  const float lo = from - slack, hi = from + static_cast<float>(width) * layout.size + slack;
  const float outside = lo > 0 ? lo : (hi < 0 ? -hi : 0);
  const float a = fabsf(lo), b = fabsf(hi), far = a < b ? b : a;
  return {outside * outside, far * far};
}

IST_HD inline GridRelation grid_relation(const SphereGridLayout& layout, const Sphere& s,
                                         AxisSpan x, AxisSpan y, AxisSpan z) {
  const float outer = listed_radius(layout, s);
  if (x.near2 + y.near2 + z.near2 > outer * outer) return GridRelation::away;
  const float inner = s.r * 0.9999f - 1e-6f;
  const float inner2 = inner > 0 ? inner * inner : 0;
  return x.far2 + y.far2 + z.far2 < inner2 ? GridRelation::covers : GridRelation::near;
}

/// Block (i, j, k): cells from (8i, 8j, 8k) on.
IST_HD inline GridRelation block_relation(const SphereGridLayout& layout, const Sphere& s, int i,
                                          int j, int k) {
  return grid_relation(layout, s, axis_span(layout, 8 * i, 8, s.x),
                       axis_span(layout, 8 * j, 8, s.y), axis_span(layout, 8 * k, 8, s.z));
}

/// Cell (i, j, k) of a block that the sphere is near. If the sphere is away from the block or
/// covers it, this is true for all of the block's cells.
IST_HD inline GridRelation cell_relation(const SphereGridLayout& layout, const Sphere& s, int i,
                                         int j, int k) {
  return grid_relation(layout, s, axis_span(layout, i, 1, s.x), axis_span(layout, j, 1, s.y),
                       axis_span(layout, k, 1, s.z));
}

}  // namespace ist::packing
