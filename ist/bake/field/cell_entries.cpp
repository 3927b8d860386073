#include "bake/field/cell_entries.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>

#include "bake/field/cell_overlap.h"

namespace ist {
namespace {

/// Cells are taken to be larger by this where triangles are looked for: of a cell, and of the unit
/// frame.
constexpr double kEnlarged = 0x1p-10, kEnlargedBy = 0x1p-21;

/// A box of cells, `end` not included.
struct CellRange {
  std::uint32_t begin[3], end[3];
};

/// Calls visit(x, y, z) for the cells of a range that the triangle meets, by halves.
template <class Visit>
void for_cells(const BrickGrid& grid, const CellOverlap& triangle, const CellRange& range,
               const Visit& visit) {
  double centre[3], half[3];
  int longest = 0;
  for (int k = 0; k < 3; ++k) {
    centre[k] = grid.low[k] + (double{1} * range.begin[k] + range.end[k]) / 2 * grid.cell;
    half[k] = double{1} * (range.end[k] - range.begin[k]) / 2 * grid.cell +
              (kEnlarged * grid.cell + kEnlargedBy);
    if (range.end[k] - range.begin[k] > range.end[longest] - range.begin[longest]) longest = k;
  }
  if (!triangle.meets(centre, half)) return;
  const std::uint32_t length = range.end[longest] - range.begin[longest];
  if (length == 1) {
    visit(range.begin[0], range.begin[1], range.begin[2]);
    return;
  }
  CellRange first = range, second = range;
  first.end[longest] = second.begin[longest] = range.begin[longest] + length / 2;
  for_cells(grid, triangle, first, visit);
  for_cells(grid, triangle, second, visit);
}

/// The cells that may hold a point of a triangle's box.
CellRange range_of(const BrickGrid& grid, const LaneCorners& t) {
  CellRange range;
  const double room = kEnlarged * grid.cell + kEnlargedBy;
  for (int k = 0; k < 3; ++k) {
    const double from = std::min({t.p[0][k], t.p[1][k], t.p[2][k]}) - room - grid.low[k];
    const double to = std::max({t.p[0][k], t.p[1][k], t.p[2][k]}) + room - grid.low[k];
    const double last = grid.cells(k) - 1;
    range.begin[k] =
        static_cast<std::uint32_t>(std::clamp(std::floor(from / grid.cell), 0.0, last));
    range.end[k] =
        static_cast<std::uint32_t>(std::clamp(std::floor(to / grid.cell), 0.0, last)) + 1;
  }
  return range;
}

}  // namespace

std::optional<std::vector<CellEntry>> find_entries(const BrickGrid& grid,
                                                   const std::vector<SurfaceBlock>& blocks,
                                                   std::size_t most) {
  std::vector<std::vector<CellEntry>> of_block(blocks.size());
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    for (std::uint32_t lane = 0; lane < blocks[b].triangles; ++lane) {
      const LaneCorners t = corners_of(blocks[b], lane);
      const auto code = static_cast<std::uint32_t>(kWidth * b + lane);
      for_cells(grid, CellOverlap(t.p[0], t.p[1], t.p[2]), range_of(grid, t),
                [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
                  of_block[b].push_back({grid.name(x, y, z), code});
                });
      if (of_block[b].size() > most) return;
    }
  });
  std::size_t count = 0;
  for (const auto& some : of_block) count += some.size();
  if (count > most) return std::nullopt;
  std::vector<CellEntry> entries;
  entries.reserve(count);
  for (const auto& some : of_block) entries.insert(entries.end(), some.begin(), some.end());
  tbb::parallel_sort(entries.begin(), entries.end());
  return entries;
}

}  // namespace ist
