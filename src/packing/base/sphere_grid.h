#pragma once

#include <vector>

#include "base/team.h"
#include "packing/base/sphere_grid_layout.h"

namespace ist::packing {

/// The lists of a SphereGridLayout on the host. Blocks exist within a sphere's reach. Reading is
/// thread-safe between insertions.
class SphereGrid {
 public:
  SphereGrid(const std::vector<Sphere>& spheres, const SphereGridLayout& layout);

  const SphereGridLayout& layout() const { return layout_; }

  void insert(std::uint32_t index, const Sphere& s);

  /// Calls visit(index) for the spheres in the list of x's cell: all within reach of x, or the one
  /// that covers the cell, and perhaps others.
  template <class Visit>
  void for_near(Float3 x, Visit&& visit) const {
    const int i = grid_coordinate(layout_, x.x), j = grid_coordinate(layout_, x.y),
              k = grid_coordinate(layout_, x.z);
    const Block& block = blocks_[layout_.block_index(i >> 3, j >> 3, k >> 3)];
    if (block.owner != kNone) return visit(block.owner);
    if (block.cells == kNone) return;
    const Cell& cell = cells_[block.cells + layout_.cell_index(i, j, k)];
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
    std::uint32_t cells = kNone;  ///< first of its cells
    std::uint32_t owner = kNone;  ///< a sphere that covers the whole block
  };

  void append(Cell& cell, std::uint32_t index);

  SphereGridLayout layout_;
  std::vector<Block> blocks_;
  std::vector<Cell> cells_;
  std::vector<Chunk> chunks_;
};

/// The spheres in the form that a PrototypeField uses, on the host.
class GridSpheres {
 public:
  GridSpheres(const std::vector<Sphere>& spheres, const SphereGrid& grid)
      : spheres_(spheres), grid_(grid) {}

  std::uint32_t count() const { return static_cast<std::uint32_t>(spheres_.size()); }
  float reach() const { return grid_.layout().reach; }

  /// Calls visit(valid, index, sphere) for the spheres in the list of x's cell. (Lanes of a wider
  /// team would make the same number of calls, those without a sphere with valid = false.)
  template <class Visit>
  void for_near(const SerialTeam&, Float3 x, Visit&& visit) const {
    grid_.for_near(x, [&](std::uint32_t i) { visit(true, i, spheres_[i]); });
  }

 private:
  const std::vector<Sphere>& spheres_;
  const SphereGrid& grid_;
};

}  // namespace ist::packing
