#pragma once

#include "cuda/packing/banded/coop_launch.h"
#include "packing/base/sphere_grid_layout.h"

namespace ist::gpu {

/// The sphere grid in device memory: lists as sets (packing/base/sphere_grid_layout.h), filled by
/// many teams at once. A table of blocks of 8³ cells, cells wherever a sphere is near, and for each
/// cell a list, which is a segment of one pool of words that starts with its length. Filling takes
/// passes with a barrier between them: touch_blocks for every sphere, then count_in_cells,
/// reserve_lists and fill_cells for every (sphere, block) pair that it listed.
struct SphereLists {
  struct Cell {
    std::uint32_t where;  ///< segment, 0: none; the coverer of a covered cell
    std::uint32_t size;   ///< of the list
  };
  struct Pair {
    std::uint32_t sphere, block;
  };
  /// One of `count` equal shares of the cells of a pair.
  struct Share {
    std::uint32_t index, count;
  };
  /// The used part of the pools, above their capacities if they were too small. Then the lists are
  /// unusable until they are refilled.
  struct Use {
    std::uint64_t words;
    std::uint32_t cell_blocks;
    std::uint32_t pairs;
  };
  static constexpr std::uint32_t kCoveredBlock = 0x80000000u;  ///< | its coverer
  static constexpr std::uint32_t kBlockInMaking =
      0x7FFFFFFFu;                                         ///< else 0: no cells, or 1 + their index
  static constexpr std::uint32_t kCovered = 0x80000000u;   ///< in Cell::size
  static constexpr std::uint32_t kInMaking = 0x80000000u;  ///< in Cell::where
  static constexpr std::uint32_t kCellsPerBlock = packing::SphereGridLayout::kCellsPerBlock;
  static constexpr std::uint32_t kMostBlocks =
      packing::kMostBlocksPerSide * packing::kMostBlocksPerSide * packing::kMostBlocksPerSide;
  static constexpr std::uint64_t kFirstWord = 8;

  packing::SphereGridLayout layout;
  std::uint32_t* blocks;  ///< kMostBlocks
  Cell* cells;            ///< all zero beyond the blocks in use
  std::uint32_t* words;
  Pair* pairs;
  Use* use;
  std::uint64_t word_capacity;
  std::uint32_t block_capacity, pair_capacity;

  /// The number of words of a list of `size` ≤ 2³⁰, its length included. Grows by steps of a third
  /// or more.
  IST_HD static std::uint32_t words_for(std::uint32_t size) {
    std::uint32_t step = 8;
    while (4 * step <= size) step *= 2;
    return (size + step) / step * step;
  }

  /// Calls visit(index) in every lane for the spheres listed at x; `valid` if the lane has one.
  template <class Team, class Visit>
  IST_HD void for_near(const Team& team, Float3 x, const Visit& visit) const {
    const int i = packing::grid_coordinate(layout, x.x);
    const int j = packing::grid_coordinate(layout, x.y);
    const int k = packing::grid_coordinate(layout, x.z);
    const std::uint32_t block =
        in_global_memory(blocks)[layout.block_index(i >> 3, j >> 3, k >> 3)];
    std::uint32_t count = 0, only = 0;
    const std::uint32_t* list = nullptr;
    if ((block & kCoveredBlock) != 0) {
      count = 1;
      only = block & ~kCoveredBlock;
    } else if (block != 0) {
      const Cell cell = in_global_memory(
          cells)[std::size_t{block - 1} * kCellsPerBlock + layout.cell_index(i, j, k)];
      if ((cell.size & kCovered) != 0) {
        count = 1;
        only = cell.where;
      } else {
        count = cell.size;
        list = in_global_memory(words) + cell.where + 1;
      }
    }
    IST_ROLLED for (std::uint32_t base = 0; base < count; base += Team::kWidth) {
      const std::uint32_t n = base + static_cast<std::uint32_t>(team.lane());
      const bool valid = n < count;
      visit(valid, valid && list != nullptr ? list[n] : only);
    }
  }

  /// First pass over a sphere: lists the blocks near it, gives them cells, and marks those that it
  /// covers.
  template <class Team>
  IST_HD void touch_blocks(const Team& team, std::uint32_t index, const Sphere& s) const {
    const packing::GridRange range = packing::grid_range(layout, s);
    const int first[3] = {range.lo[0] >> 3, range.lo[1] >> 3, range.lo[2] >> 3};
    const int nx = (range.hi[0] >> 3) - first[0] + 1, ny = (range.hi[1] >> 3) - first[1] + 1,
              nz = (range.hi[2] >> 3) - first[2] + 1;
    for (int base = 0; base < nx * ny * nz; base += Team::kWidth) {
      const int n = base + team.lane();
      bool near = false;
      std::uint32_t block = 0;
      if (n < nx * ny * nz) {
        const int i = first[0] + n % nx, j = first[1] + n / nx % ny, k = first[2] + n / nx / ny;
        block = layout.block_index(i, j, k);
        const packing::GridRelation relation = packing::block_relation(layout, s, i, j, k);
        if (relation == packing::GridRelation::covers)
          atomic_exchange(&blocks[block], kCoveredBlock | index);
        near = relation == packing::GridRelation::near &&
               (atomic_load(&blocks[block]) & kCoveredBlock) == 0;
        if (near && atomic_replace(&blocks[block], 0, kBlockInMaking) == 0) {
          const std::uint32_t fresh = atomic_add(&use->cell_blocks, 1);
          if (fresh < block_capacity) atomic_replace(&blocks[block], kBlockInMaking, fresh + 1);
        }
      }
      const std::uint32_t place = append(team, near, &use->pairs);
      if (near && place < pair_capacity) pairs[place] = {index, block};
    }
  }

  IST_HD bool overflown() const {
    return use->words > word_capacity || use->cell_blocks > block_capacity ||
           use->pairs > pair_capacity;
  }

  /// Second pass, over a listed pair: counts the additional entries of lists.
  template <class Team>
  IST_HD void count_in_cells(const Team& team, const Pair& pair, const Sphere& s,
                             Share share) const {
    for_cells(team, pair, s, share, [&](Cell& cell, packing::GridRelation relation) {
      if (relation == packing::GridRelation::covers) {
        atomic_exchange(&cell.where, pair.sphere);
        atomic_or(&cell.size, kCovered);
      } else if ((atomic_load(&cell.size) & kCovered) == 0) {
        atomic_add(&cell.size, 1);
      }
    });
  }

  /// Third pass: the first pair at a cell gives it a segment for the longer list.
  template <class Team>
  IST_HD void reserve_lists(const Team& team, const Pair& pair, const Sphere& s,
                            Share share) const {
    for_cells(team, pair, s, share, [&](Cell& cell, packing::GridRelation) {
      if ((cell.size & kCovered) != 0) return;
      const std::uint32_t old = atomic_or(&cell.where, kInMaking);
      if ((old & kInMaking) != 0) return;
      const std::uint32_t listed = old == 0 ? 0 : words[old];
      const std::uint32_t wanted = words_for(cell.size);
      if (old != 0 && wanted == words_for(listed)) return;
      const std::uint64_t fresh = atomic_add(&use->words, std::uint64_t{wanted});
      if (fresh + wanted > word_capacity) return;
      words[fresh] = listed;
      for (std::uint32_t i = 1; i <= listed; ++i) words[fresh + i] = words[old + i];
      atomic_exchange(&cell.where, static_cast<std::uint32_t>(fresh) | kInMaking);
    });
  }

  /// Fourth pass: adds the sphere to the lists.
  template <class Team>
  IST_HD void fill_cells(const Team& team, const Pair& pair, const Sphere& s, Share share) const {
    for_cells(team, pair, s, share, [&](Cell& cell, packing::GridRelation) {
      if ((cell.size & kCovered) != 0) return;
      std::uint32_t* segment = words + (atomic_load(&cell.where) & ~kInMaking);
      const std::uint32_t place = atomic_add(segment, 1);
      segment[1 + place] = pair.sphere;
      if (place + 1 == cell.size) atomic_and(&cell.where, ~kInMaking);
    });
  }

 private:
  /// Calls visit(cell, relation) for the cells of the pair's block, in this share, that the sphere
  /// comes near. The order depends on the lane.
  template <class Team, class Visit>
  IST_HD void for_cells(const Team& team, const Pair& pair, const Sphere& s, Share share,
                        const Visit& visit) const {
    const std::uint32_t block = blocks[pair.block];
    if ((block & kCoveredBlock) != 0) return;
    Cell* const own = cells + std::size_t{block - 1} * kCellsPerBlock;
    const auto side = static_cast<std::uint32_t>(layout.blocks_per_side);
    const std::uint32_t at[3] = {pair.block % side, pair.block / side % side,
                                 pair.block / side / side};
    const packing::GridRange range = packing::grid_range(layout, s);
    int lo[3], count[3];
    for (int axis = 0; axis < 3; ++axis) {
      const int first = 8 * static_cast<int>(at[axis]);
      lo[axis] = range.lo[axis] > first ? range.lo[axis] : first;
      const int hi = range.hi[axis] < first + 7 ? range.hi[axis] : first + 7;
      count[axis] = hi - lo[axis] + 1;
    }
    const int stride = static_cast<int>(share.count) * Team::kWidth;
    for (int n = static_cast<int>(share.index) * Team::kWidth + team.lane();
         n < count[0] * count[1] * count[2]; n += stride) {
      const int i = lo[0] + n % count[0], j = lo[1] + n / count[0] % count[1],
                k = lo[2] + n / count[0] / count[1];
      const packing::GridRelation relation = packing::cell_relation(layout, s, i, j, k);
      if (relation != packing::GridRelation::away) visit(own[layout.cell_index(i, j, k)], relation);
    }
  }
};

/// The next step of the launch. Every step ends at a barrier.
enum class Step : std::uint32_t {
  start,       ///< the root cell's side
  sweep,       ///< drop dead cells, find the largest bound; the schedule begins a band
  clear_grid,  ///< rebuild the sphere grid
  touch_all,   ///< list every sphere
  count,       ///< the sphere grid's passes over the listed pairs
  reserve_lists,
  fill,
  activate,  ///< cells that reach the margin become the frontier
  refresh,   ///< the frontier's cells of one class: settles many, leaves the rest open
  confine,   ///< the open cells: bounds by the surface
  work,      ///< on the frontier's cells, or those that are still open
  split,     ///< the cells that are neither settled nor have a candidate
  collect,   ///< candidates into buckets
  dominate,  ///< the candidates that no other outranks
  certify,
  insert,  ///< winners in order, and the blocks of the grid that they touch
  finished,
};

/// The buffer that is too small for the next step. The launch ends; the host enlarges it and starts
/// another launch from the same step.
enum class Need : std::uint32_t { nothing, cells, candidates, spheres, grid };

}  // namespace ist::gpu
