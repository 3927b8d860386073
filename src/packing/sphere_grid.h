#pragma once

#include <cstdint>
#include <vector>

#include <ist/packing.h>

#include "packing/float3.h"

namespace ist::packing {

/// Spheres by place. A sphere is listed in every grid cell within `reach` of its surface, so what
/// is no further than `reach` from a point stands in the one cell that holds the point. Cells come
/// in blocks of 8³ that exist where a sphere's reach touches them; blocks and cells wholly inside a
/// sphere list that sphere alone. Reading is thread-safe between insertions.
class SphereGrid {
 public:
  /// Lists `spheres` (in order). reach > 0, unit frame.
  SphereGrid(const std::vector<Sphere>& spheres, float reach);

  float reach() const { return reach_; }
  std::size_t built_for() const { return built_for_; }  ///< count of spheres it was laid out for

  /// Lists sphere `index` = {centre, r}.
  void insert(std::uint32_t index, const Sphere& sphere);

  /// Calls visit(index) for every sphere within reach of x, and perhaps others.
  template <class Visit>
  void for_near(Float3 x, Visit&& visit) const {
    const int i = cell_of(x.x), j = cell_of(x.y), k = cell_of(x.z);
    const Block& block = blocks_[block_index(i >> 3, j >> 3, k >> 3)];
    if (block.owner != kNone) return visit(block.owner);
    if (block.cells == kNone) return;
    const Cell& cell = cells_[block.cells + cell_index(i & 7, j & 7, k & 7)];
    for (std::uint32_t chunk = cell.head; chunk != kNone; chunk = chunks_[chunk].next)
      for (std::uint32_t n = 0; n < chunks_[chunk].size; ++n) visit(chunks_[chunk].index[n]);
  }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  static constexpr std::uint32_t kChunk = 14;
  struct Chunk {
    std::uint32_t next = kNone;
    std::uint32_t size = 0;
    std::uint32_t index[kChunk];
  };
  struct Cell {
    std::uint32_t head = kNone, tail = kNone;
    bool covered = false;
  };
  struct Block {
    std::uint32_t cells = kNone;  ///< first of its 512 cells
    std::uint32_t owner = kNone;  ///< a sphere that holds the whole block
  };

  int cell_of(float x) const {
    const int i = static_cast<int>((x + kHalfExtent) * inverse_size_);
    return i < 0 ? 0 : (i >= cells_per_side_ ? cells_per_side_ - 1 : i);
  }
  std::size_t block_index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(blocks_per_side_) +
            static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(blocks_per_side_) +
           static_cast<std::size_t>(i);
  }
  static std::uint32_t cell_index(int i, int j, int k) {
    return static_cast<std::uint32_t>((k * 8 + j) * 8 + i);
  }
  void append(Cell& cell, std::uint32_t index);

  static constexpr float kHalfExtent = 1.0f;
  std::size_t built_for_;
  float reach_, size_, inverse_size_;
  int blocks_per_side_, cells_per_side_;
  std::vector<Block> blocks_;
  std::vector<Cell> cells_;
  std::vector<Chunk> chunks_;
};

}  // namespace ist::packing
