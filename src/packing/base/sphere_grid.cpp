#include "packing/base/sphere_grid.h"

#include <algorithm>

namespace ist::packing {

SphereGrid::SphereGrid(const std::vector<Sphere>& spheres, const SphereGridLayout& layout)
    : layout_(layout) {
  blocks_.resize(layout_.block_count());
  for (std::size_t i = 0; i < spheres.size(); ++i)
    insert(static_cast<std::uint32_t>(i), spheres[i]);
}

void SphereGrid::append(Cell& cell, std::uint32_t index) {
  if (cell.tail == kNone || chunks_[cell.tail].size == kChunk) {
    const auto fresh = static_cast<std::uint32_t>(chunks_.size());
    chunks_.emplace_back();
    (cell.tail == kNone ? cell.head : chunks_[cell.tail].next) = fresh;
    cell.tail = fresh;
  }
  Chunk& chunk = chunks_[cell.tail];
  chunk.index[chunk.size++] = index;
}

void SphereGrid::insert(std::uint32_t index, const Sphere& s) {
  const GridRange range = grid_range(layout_, s);
  const int* lo = range.lo;
  const int* hi = range.hi;
  for (int bk = lo[2] >> 3; bk <= hi[2] >> 3; ++bk)
    for (int bj = lo[1] >> 3; bj <= hi[1] >> 3; ++bj)
      for (int bi = lo[0] >> 3; bi <= hi[0] >> 3; ++bi) {
        Block& block = blocks_[layout_.block_index(bi, bj, bk)];
        if (block.owner != kNone) continue;
        const GridRelation to_block = block_relation(layout_, s, bi, bj, bk);
        if (to_block == GridRelation::covers) block.owner = index;
        if (to_block != GridRelation::near) continue;
        if (block.cells == kNone) {
          block.cells = static_cast<std::uint32_t>(cells_.size());
          cells_.resize(cells_.size() + SphereGridLayout::kCellsPerBlock);
        }
        for (int k = std::max(8 * bk, lo[2]); k <= std::min(8 * bk + 7, hi[2]); ++k)
          for (int j = std::max(8 * bj, lo[1]); j <= std::min(8 * bj + 7, hi[1]); ++j) {
            const AxisSpan z = axis_span(layout_, k, 1, s.z), y = axis_span(layout_, j, 1, s.y);
            for (int i = std::max(8 * bi, lo[0]); i <= std::min(8 * bi + 7, hi[0]); ++i) {
              Cell& cell = cells_[block.cells + layout_.cell_index(i, j, k)];
              if (cell.covered) continue;
              const GridRelation relation =
                  grid_relation(layout_, s, axis_span(layout_, i, 1, s.x), y, z);
              if (relation == GridRelation::away) continue;
              if (relation == GridRelation::covers) {
                cell = Cell{};
                cell.covered = true;
              }
              append(cell, index);
            }
          }
      }
}

}  // namespace ist::packing
