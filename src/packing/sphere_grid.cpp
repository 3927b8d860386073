#include "packing/sphere_grid.h"

#include <algorithm>
#include <cmath>

namespace ist::packing {
namespace {

/// Nearest and farthest distance² from 0 along one axis to the interval [lo, hi].
struct Span {
  float near2, far2;
};
Span span_of(float lo, float hi) {
  const float outside = lo > 0 ? lo : (hi < 0 ? -hi : 0);
  const float far = std::max(std::fabs(lo), std::fabs(hi));
  return {outside * outside, far * far};
}

}  // namespace

SphereGrid::SphereGrid(const std::vector<Sphere>& spheres, float reach)
    : built_for_(spheres.size()), reach_(reach) {
  // Cells of about the reach, so that lists are short; but no more than the spheres are worth (a
  // single large one would be listed in millions).
  const float wanted = 2 * kHalfExtent / reach;
  blocks_per_side_ = std::clamp(static_cast<int>(wanted / 8) + 1, 1, 128);
  const auto most = static_cast<std::int64_t>(27 * std::max<std::size_t>(spheres.size(), 1));
  while (std::int64_t{blocks_per_side_} * blocks_per_side_ * blocks_per_side_ > most)
    --blocks_per_side_;
  cells_per_side_ = 8 * blocks_per_side_;
  size_ = 2 * kHalfExtent / static_cast<float>(cells_per_side_);
  inverse_size_ = 1 / size_;
  const auto side = static_cast<std::size_t>(blocks_per_side_);
  blocks_.resize(side * side * side);
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
  // Margins make up for rounding here and in cell_of(): listing a sphere too often is harmless.
  const float outer = (s.r + reach_) * 1.0001f + 1e-6f;
  const float outer2 = outer * outer;
  const float inner = s.r * 0.9999f - 1e-6f;
  const float inner2 = inner > 0 ? inner * inner : 0;
  const float slack = 1e-6f;
  const int lo[3] = {cell_of(s.x - outer), cell_of(s.y - outer), cell_of(s.z - outer)};
  const int hi[3] = {cell_of(s.x + outer), cell_of(s.y + outer), cell_of(s.z + outer)};
  const auto span = [&](int cell, int width, float centre) {
    const float from = static_cast<float>(cell) * size_ - kHalfExtent - centre;
    return span_of(from - slack, from + static_cast<float>(width) * size_ + slack);
  };
  for (int bk = lo[2] >> 3; bk <= hi[2] >> 3; ++bk)
    for (int bj = lo[1] >> 3; bj <= hi[1] >> 3; ++bj)
      for (int bi = lo[0] >> 3; bi <= hi[0] >> 3; ++bi) {
        Block& block = blocks_[block_index(bi, bj, bk)];
        if (block.owner != kNone) continue;
        const Span x = span(8 * bi, 8, s.x), y = span(8 * bj, 8, s.y), z = span(8 * bk, 8, s.z);
        if (x.near2 + y.near2 + z.near2 > outer2) continue;
        if (x.far2 + y.far2 + z.far2 < inner2) {
          block.owner = index;
          continue;
        }
        if (block.cells == kNone) {
          block.cells = static_cast<std::uint32_t>(cells_.size());
          cells_.resize(cells_.size() + 512);
        }
        for (int k = std::max(8 * bk, lo[2]); k <= std::min(8 * bk + 7, hi[2]); ++k)
          for (int j = std::max(8 * bj, lo[1]); j <= std::min(8 * bj + 7, hi[1]); ++j) {
            const Span cz = span(k, 1, s.z), cy = span(j, 1, s.y);
            if (cz.near2 + cy.near2 > outer2) continue;
            for (int i = std::max(8 * bi, lo[0]); i <= std::min(8 * bi + 7, hi[0]); ++i) {
              Cell& cell = cells_[block.cells + cell_index(i & 7, j & 7, k & 7)];
              if (cell.covered) continue;
              const Span cx = span(i, 1, s.x);
              if (cx.near2 + cy.near2 + cz.near2 > outer2) continue;
              cell.covered = cx.far2 + cy.far2 + cz.far2 < inner2;
              append(cell, index);
            }
          }
      }
}

}  // namespace ist::packing
