#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <ist/asset_layout.h>

#include "bake/field/cell_grid.h"

namespace ist {

struct TriangleCorners {
  double p[3][3];
};

inline TriangleCorners corners_of(const SurfaceBlock& block, std::uint32_t lane) {
  TriangleCorners out;
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
  std::uint64_t cell;      ///< CellGrid::name
  std::uint32_t triangle;  ///< 16 · block + lane
  friend auto operator<=>(const CellEntry&, const CellEntry&) = default;
};

/// Which triangles of the blocks are in which cells: all pairs, sorted; nothing where there are
/// more than `most`. Cells are taken to be a little larger than they are: a query may round
/// coordinates to float.
std::optional<std::vector<CellEntry>> find_entries(const CellGrid& grid,
                                                   const std::vector<SurfaceBlock>& blocks,
                                                   std::size_t most);

}  // namespace ist
