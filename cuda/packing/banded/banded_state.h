#pragma once

#include <cstdint>

#include "cuda/packing/banded/sphere_lists.h"
#include "packing/banded/band_schedule.h"
#include "packing/banded/candidate.h"
#include "packing/banded/cell.h"

namespace ist::gpu {

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
  std::uint32_t checks;  ///< completed checks, the flags below
  float by_surface;      ///< radius certified against the surface
  float by_spheres;      ///< radius certified against spheres and other winners

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

/// Winners by radius, so that a winner finds its position without visiting all others.
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

/// Progress of the packing for a watching host, and its request to stop.
struct Mailbox {
  volatile std::uint32_t spheres;
  volatile float radius;
  volatile std::uint64_t covered;
  volatile std::uint32_t stop;  ///< set by the host
};

/// All changing data except for the large arrays. Read by all teams, written by the last team to
/// reach a barrier, or by atomics.
struct BandedState {
  packing::BandSchedule schedule;
  Step step = Step::start;
  Step after_grid = Step::activate;  ///< the step after the grid's passes
  Need need = Need::nothing;
  std::uint32_t taken = 0;  ///< items of this step that teams have taken

  // Cells. A slot with bound 0 is free; the next sweep finds it.
  std::uint32_t slots = 1;             ///< in use or free
  std::uint32_t free = 0;              ///< end of the queue in free_list, before the modulus
  std::uint32_t free_taken = 0;        ///< its front
  std::uint32_t live = 1;              ///< as the schedule counts them
  std::uint32_t top = 0, dropped = 0;  ///< bits of bounds, positive floats

  // Lists of cells. The frontier is in one of two arrays, the active cells in the other.
  std::uint32_t frontier = 0, active = 0, splitting = 0;
  std::uint32_t frontier_array = 0;
  std::uint32_t cell_class = 0, classes = 1;
  bool in_parts = false;                      ///< with steps `refresh` and `confine` before `work`
  std::uint32_t refreshed = 0, confined = 0;  ///< cells that these steps left open

  // Levels that one step does: see work_on_cells().
  std::uint32_t depth = 0;     ///< levels below the frontier's
  std::uint32_t queued = 0;    ///< children put into the queue
  std::uint32_t pending = 0;   ///< cells and children still to process
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
  std::uint32_t* splitting;             ///< cell | remaining children << kCellBits
  std::uint32_t cell_capacity;
  std::uint32_t* queue;  ///< children to create, ChildCode; all kNone between steps
  std::uint32_t queue_capacity;

  BucketNode* nodes;
  std::uint32_t* heads;  ///< of the buckets; all 0 between rounds
  std::uint32_t* won;    ///< by node
  Winner* winners;
  RankBuckets* ranks;
  std::uint32_t candidate_capacity;  ///< heads: twice as many and 64

  StoredSphere* spheres;
  float* kept;  ///< radius over the largest bound at insertion, by sphere
  std::uint32_t sphere_capacity;

  SphereLists lists_of_spheres;  ///< layout and use: see the state
  Mailbox* mailbox;              ///< null without a watching host

  std::uint32_t many = kMany;  ///< from so many cells on, a level is processed in parts

  static constexpr std::uint32_t kMany = 8192;
  static constexpr std::uint32_t kCellBits = 24;

  IST_HD SphereLists grid() const {
    SphereLists grid = lists_of_spheres;
    grid.layout = state->layout;
    return grid;
  }
};

/// The packed spheres in the form that the packing numerics use.
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
