#pragma once

#include <cstdint>

#include "cuda/base/atomics.h"
#include "packing/banded/band_schedule.h"
#include "packing/banded/candidate.h"
#include "packing/banded/cell.h"
#include "packing/base/sphere_grid_layout.h"

namespace ist::gpu {

// A cooperative launch is all the teams that do one packing together: the warps of a kernel, or a
// few threads of the host (tests). Steps are templates over it. It has
//
//   using Team;             const Team& team() const;
//   using Lane;             a team of one of its lanes
//   Scratch& scratch();     this team's own memory
//   std::uint32_t index();  this team's number, below size()
//   void pause();           waits a little for other teams
//   void sync(last);        all teams meet; the last to come runs last(), then all go on and see
//                           what any of them wrote before

/// Calls work(i) for all i < count, a team an item, a fixed share each: for items of equal work.
template <class CoopLaunch, class Work>
IST_HD void distribute_statically(CoopLaunch& coop, std::uint32_t count, const Work& work) {
  for (std::uint32_t i = coop.index(); i < count; i += coop.size()) work(i);
}

/// The same, each team taking the next item when it is done with one. `taken` starts at 0.
template <class CoopLaunch, class Work>
IST_HD void distribute_dynamically(CoopLaunch& coop, std::uint32_t count, std::uint32_t* taken,
                                   const Work& work) {
  std::uint32_t i = coop.index();
  while (i < count) {
    work(i);
    if (count <= coop.size()) return;
    i = coop.size() + take(coop.team(), taken, 1);
  }
}

/// Calls work(i) for all i < count, a lane an item. A team's lanes come together: where i ≥ count,
/// `work` is called all the same and must only take part in what the team does together.
template <class CoopLaunch, class Work>
IST_HD void distribute_to_lanes(CoopLaunch& coop, std::uint32_t count, const Work& work) {
  constexpr auto kWidth = static_cast<std::uint32_t>(CoopLaunch::Team::kWidth);
  const std::uint32_t stride = coop.size() * kWidth;
  for (std::uint32_t base = coop.index() * kWidth; base < count; base += stride)
    work(base + static_cast<std::uint32_t>(coop.team().lane()));
}

/// The sphere grid in device memory: lists as sets (packing/base/sphere_grid_layout.h), filled
/// by many teams at once. A table of blocks of 8³ cells; cells where a sphere comes near; a cell's
/// list is a segment of one pool of words, its length first. Filling goes in passes with a meeting
/// of all teams between them: touch_blocks of every sphere, then count_in_cells, make_room and
/// fill_cells of every (sphere, block) pair that it noted.
struct SphereLists {
  struct Cell {
    std::uint32_t where;  ///< segment, 0: none; the coverer of a covered cell
    std::uint32_t size;   ///< of the list
  };
  struct Pair {
    std::uint32_t sphere, block;
  };
  /// One of `count` equal shares of the cells that a pair has in common.
  struct Share {
    std::uint32_t index, count;
  };
  /// The used part of the pools; above their capacities if they were too small. Then the lists are
  /// unusable until they are filled again.
  struct Use {
    std::uint64_t words;
    std::uint32_t cell_blocks;
    std::uint32_t pairs;
  };
  static constexpr std::uint32_t kCoveredBlock = 0x80000000u;   ///< | its coverer
  static constexpr std::uint32_t kBlockInMaking = 0x7FFFFFFFu;  ///< else 0: no cells, or 1 + which
  static constexpr std::uint32_t kCovered = 0x80000000u;        ///< in Cell::size
  static constexpr std::uint32_t kInMaking = 0x80000000u;       ///< in Cell::where
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

  /// Words that a list of `size` ≤ 2³⁰ takes, its length included. Grows by steps of a third or
  /// more.
  IST_HD static std::uint32_t words_for(std::uint32_t size) {
    std::uint32_t step = 8;
    while (4 * step <= size) step *= 2;
    return (size + step) / step * step;
  }

  /// Calls visit(index) in every lane for the spheres listed at x, `valid` where the lane has one.
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

  /// First pass over a sphere: notes the blocks that it comes near, gives them cells, and takes
  /// those that it covers.
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

  /// Second pass, over a noted pair: how much longer lists become.
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

  /// Third pass: the first pair that comes to a cell gives it a segment for the longer list.
  template <class Team>
  IST_HD void make_room(const Team& team, const Pair& pair, const Sphere& s, Share share) const {
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

  /// Fourth pass: lists the sphere.
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
  /// Calls visit(cell, relation) for the cells of the pair's block that the sphere is not away
  /// from, of this share, in the lanes' own order.
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
  clear_grid,  ///< lay the sphere grid out anew …
  touch_all,   ///< … and list every sphere
  count,       ///< the sphere grid's passes over the noted pairs
  make_room,
  fill,
  activate,  ///< cells that reach the margin become the frontier
  refresh,   ///< the frontier's cells of one class: many settle already, the rest are open
  confine,   ///< the open cells: what the surface tells of them
  work,      ///< on the frontier's cells, or those that are open still
  split,     ///< the cells that have neither settled nor a candidate
  collect,   ///< candidates into buckets
  dominate,  ///< which of them no other one goes before
  certify,
  insert,  ///< winners in order, and the blocks of the grid that they touch
  finished,
};

/// The buffer that is too small for the next step. The launch ends; the host enlarges it and starts
/// another launch where this one stopped.
enum class Need : std::uint32_t { nothing, cells, candidates, spheres, grid };

/// A candidate in a chain of its bucket.
struct alignas(16) BucketNode {
  packing::Candidate candidate;
  std::uint32_t cell;
  std::uint32_t next;  ///< 1 + the next one's place, 0: the last
};

/// A candidate that no other outranks: it may become a sphere.
struct Winner {
  std::uint64_t key;     ///< the candidate's; 0: not accepted
  std::uint32_t node;    ///< place in nodes
  std::uint32_t next;    ///< 1 + the next of its rank bucket, 0: the last
  std::uint32_t checks;  ///< what is known of it, the flags below
  float by_surface;      ///< radius certified against the surface
  float by_spheres;      ///< … against spheres and other winners

  static constexpr std::uint32_t kBySurface = 1;
  static constexpr std::uint32_t kBySpheres = 2;
  static constexpr std::uint32_t kInside = 4;
  static constexpr std::uint32_t kOutside = 8;

  IST_HD static bool all_known(std::uint32_t checks) {
    return (checks & kBySurface) != 0 && (checks & kBySpheres) != 0 &&
           (checks & (kInside | kOutside)) != 0;
  }
  IST_HD float radius() const { return by_surface < by_spheres ? by_surface : by_spheres; }
};

/// Winners by radius, so that one finds its place among them without looking at them all.
struct RankBuckets {
  static constexpr std::uint32_t kCount = 1024;
  std::uint32_t size[kCount];
  std::uint32_t head[kCount];  ///< 1 + a winner, 0: none
};

/// A sphere in one load.
struct alignas(16) StoredSphere {
  float x, y, z, r;
  IST_HD Sphere sphere() const { return {x, y, z, r}; }
};

/// Tells a host that watches how far the packing is, and takes its request to stop.
struct Mailbox {
  volatile std::uint32_t spheres;
  volatile float radius;
  volatile std::uint64_t covered;
  volatile std::uint32_t stop;  ///< set by the host
};

/// All that changes but for the large arrays. Read by all teams, written by the last one that comes
/// to a meeting, or by atomics.
struct BandedState {
  packing::BandSchedule schedule;
  Step step = Step::start;
  Step after_grid = Step::activate;  ///< where the grid's passes lead to
  Need need = Need::nothing;
  std::uint32_t taken = 0;  ///< items of this step that teams took in turns

  // Cells. A slot whose bound is 0 is free, and found by the next sweep.
  std::uint32_t slots = 1;             ///< in use or free
  std::uint32_t free = 0;              ///< end of the queue in free_list, before the modulus
  std::uint32_t free_taken = 0;        ///< its front
  std::uint32_t live = 1;              ///< as the schedule counts them
  std::uint32_t top = 0, dropped = 0;  ///< bits of bounds, positive floats

  // Lists of cells. The frontier is in one of two arrays and the active ones go to the other.
  std::uint32_t frontier = 0, active = 0, splitting = 0;
  std::uint32_t frontier_array = 0;
  std::uint32_t cell_class = 0, classes = 1;
  bool in_parts = false;                      ///< with steps `refresh` and `confine` before `work`
  std::uint32_t refreshed = 0, confined = 0;  ///< cells that these left open

  // Levels that one step does: see work_on_cells().
  std::uint32_t depth = 0;     ///< levels below the frontier's
  std::uint32_t queued = 0;    ///< children put into the queue
  std::uint32_t pending = 0;   ///< cells and children not yet done with
  std::uint32_t cascaded = 0;  ///< cells that were split

  // Selection.
  std::uint32_t largest_radius = 0;  ///< bits
  std::uint32_t largest_bound = 0;   ///< bits; of the candidates' cells
  packing::CandidateBuckets buckets;
  std::uint32_t winners = 0, accepted = 0;
  std::uint64_t volume = 0;  ///< of the spheres inserted in this step

  packing::SphereGridLayout layout;
  SphereLists::Use use{SphereLists::kFirstWord, 0, 0};

  std::uint32_t stop_asked = 0;
};

/// The arrays, by value.
struct BandedArrays {
  using Cell = packing::StoredCell<std::uint32_t>;

  BandedState* state;
  Cell* cells;
  float* bounds;                        ///< the cells' bounds again; 0: free slot
  std::uint32_t* free_list;             ///< slots
  std::uint32_t* lists[2];              ///< frontier and active cells
  std::uint32_t *refreshed, *confined;  ///< cells
  std::uint32_t* splitting;             ///< cell | children that are still to make << kCellBits
  std::uint32_t cell_capacity;
  std::uint32_t* queue;  ///< children to make, ChildCode; all kNone between steps
  std::uint32_t queue_capacity;

  BucketNode* nodes;
  std::uint32_t* heads;  ///< of the buckets; all 0 between rounds
  std::uint32_t* won;    ///< by node
  Winner* winners;
  RankBuckets* ranks;
  std::uint32_t candidate_capacity;  ///< heads: twice as many and 64

  StoredSphere* spheres;
  float* kept;  ///< radius over the largest bound when it was inserted, by sphere
  std::uint32_t sphere_capacity;

  SphereLists lists_of_spheres;  ///< layout and use: see the state
  Mailbox* mailbox;              ///< null if nobody looks on

  std::uint32_t many = kMany;  ///< cells from which on a level is worked on in parts

  static constexpr std::uint32_t kMany = 8192;
  static constexpr std::uint32_t kCellBits = 24;

  IST_HD SphereLists grid() const {
    SphereLists grid = lists_of_spheres;
    grid.layout = state->layout;
    return grid;
  }
};

/// The packed spheres as the packing numerics ask for them.
struct ListedSpheres {
  SphereLists lists;
  const StoredSphere* spheres;
  std::uint32_t size;

  IST_HD std::uint32_t count() const { return size; }
  IST_HD float reach() const { return lists.layout.reach; }

  template <class Team, class Visit>
  IST_HD void for_near(const Team& team, Float3 x, Visit&& visit) const {
    lists.for_near(team, x, [&](bool valid, std::uint32_t index) {
      visit(valid, index, in_global_memory(spheres)[index].sphere());
    });
  }
};

IST_HD inline ListedSpheres listed_spheres(const BandedArrays& a) {
  return {a.grid(), a.spheres, static_cast<std::uint32_t>(a.state->schedule.spheres)};
}

}  // namespace ist::gpu
