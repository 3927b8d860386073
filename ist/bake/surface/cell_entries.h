#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <ist/asset_layout.h>

#include "bake/surface/brick_grid.h"

namespace ist {

/// Of the triangle in a lane of a block.
struct LaneCorners {
  double p[3][3];
};

inline LaneCorners corners_of(const SurfaceBlock& block, std::uint32_t lane) {
  LaneCorners out;
  for (int i = 0; i < 3; ++i) {
    const std::uint32_t v = block.corner[i][lane];
    out.p[i][0] = block.x[v];
    out.p[i][1] = block.y[v];
    out.p[i][2] = block.z[v];
  }
  return out;
}

/// A triangle in a cell.
struct CellEntry {
  std::uint64_t cell;      ///< BrickGrid::name
  std::uint32_t triangle;  ///< 16 · block + lane
  friend auto operator<=>(const CellEntry&, const CellEntry&) = default;
};

/// Which triangles of the blocks are in which cells: all pairs, sorted; nothing where there are
/// more than `most`. Cells are taken to be a little larger than they are: a query may round
/// coordinates to float.
std::optional<std::vector<CellEntry>> find_entries(const BrickGrid& grid,
                                                   const std::vector<SurfaceBlock>& blocks,
                                                   std::size_t most);

/// How many pairs there are, in how many cells and bricks.
struct EntryCounts {
  std::size_t entries = 0, cells = 0, bricks = 0;
  std::size_t fullest_brick = 0;  ///< entries
};

/// Counts what find_entries() finds.
std::optional<EntryCounts> count_entries(const BrickGrid& grid,
                                         const std::vector<SurfaceBlock>& blocks, std::size_t most);

}  // namespace ist
