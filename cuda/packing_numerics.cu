// The packing's shared numerics, instantiated for a warp: what is not fit for the device (a call
// into the C library, a host-only type) breaks this build and not the GPU backend's, and its
// registers and spills can be read off a small file.
#include "packing/band_schedule.h"
#include "packing/candidate.h"
#include "packing/prototype.h"
#include "packing/sphere_grid_layout.h"
#include "packing/surface_triangle.h"
#include "warp_team.h"

namespace ist::gpu {
namespace {

using namespace packing;

/// A few triangles, all of which every query looks at.
struct ListedSurface {
  using Feature = std::uint32_t;
  static constexpr int kAscentSteps = 5;
  const SurfaceTriangle* triangles;
  int count;

  template <class Team>
  IST_HD bool nearest(const Team& team, Float3 x, float limit, Feature& feature,
                      float& distance) const {
    float least = kFarAway;
    int found = 0;
    for (int i = team.lane(); i < count; i += Team::kWidth) {
      const float distance2 = offset(static_cast<Feature>(i), x).range2;
      if (distance2 < least) {
        least = distance2;
        found = i;
      }
    }
    found = index_of_least(team, least, static_cast<std::uint32_t>(found), found);
    feature = static_cast<Feature>(found);
    distance = sqrtf(least);
    return least <= limit * limit;
  }
  IST_HD SurfaceTriangle triangle(Feature i) const { return triangles[i]; }
  IST_HD FeatureOffset offset(Feature i, Float3 x) const {
    return triangle_offset(triangles[i], x);
  }
  template <class Team>
  IST_HD int triangles_within(const Team& team, Float3 x, float radius2, Feature* out,
                              int most) const {
    int kept = 0;
    for (int base = 0; base < count; base += Team::kWidth) {
      const int i = base + team.lane();
      int total = 0;
      const bool near = i < count && offset(static_cast<Feature>(i), x).range2 <= radius2;
      const int place = kept + team.exclusive_count(near, total);
      if (kept + total > most) return -1;
      if (near) out[place] = static_cast<Feature>(i);
      kept += total;
    }
    team.sync();
    return kept;
  }
  template <class Team>
  IST_HD bool inside(const Team&, Float3) const {
    return true;
  }
  template <class Team>
  IST_HD bool inside_once(const Team&, Float3) const {
    return true;
  }
  template <class Team>
  IST_HD int convex_planes(const Team& team, Float3 x, float h, bool x_inside, Feature* room,
                           int most, SampleMemory& out, int from) const {
    return packing::convex_planes(team, *this, x, h, x_inside, room, most, out, from);
  }
};

/// A few spheres, all of which every query looks at.
struct ListedSpheres {
  const Sphere* spheres;
  std::uint32_t size;

  IST_HD std::uint32_t count() const { return size; }
  IST_HD float reach() const { return 2; }
  template <class Team, class Visit>
  IST_HD void for_near(const Team& team, Float3, Visit&& visit) const {
    for (std::uint32_t base = 0; base < size; base += Team::kWidth) {
      const std::uint32_t i = base + static_cast<std::uint32_t>(team.lane());
      visit(i < size, i, spheres[i < size ? i : 0]);
    }
  }
};

using Field = PrototypeField<ListedSurface, ListedSpheres>;
constexpr int kWarps = 4;  ///< in a block

__global__ void __launch_bounds__(32 * kWarps)
    work_on_cells(ListedSurface surface, ListedSpheres spheres, const BandSchedule* schedule,
                  StoredCell<std::uint32_t>* cells, int count, CellState* states) {
  __shared__ Field::Scratch scratches[kWarps];
  const WarpTeam team;
  const int warp = static_cast<int>(threadIdx.x) / 32;
  const int i = static_cast<int>(blockIdx.x) * kWarps + warp;
  if (i >= count) return;
  Field::Scratch& scratch = scratches[warp];
  const Field field(surface, spheres);
  Cell cell = load_cell(team, cells[i], scratch);
  const CellState state = field.work(team, cell, scratch, schedule->threshold, schedule->margin,
                                     schedule->largest_half(static_cast<std::uint64_t>(count)));
  store_cell(team, cell, scratch, cells[i]);
  if (team.lane() == 0) states[i] = state;
}

__global__ void __launch_bounds__(32 * kWarps)
    split_cells(ListedSurface surface, ListedSpheres spheres, const BandSchedule* schedule,
                const StoredCell<std::uint32_t>* parents, int count,
                StoredCell<std::uint32_t>* children) {
  __shared__ Field::Scratch scratches[kWarps];
  const WarpTeam team;
  const int warp = static_cast<int>(threadIdx.x) / 32;
  const int i = static_cast<int>(blockIdx.x) * kWarps + warp;
  if (i >= 8 * count) return;
  Field::Scratch& scratch = scratches[warp];
  const Field field(surface, spheres);
  const Cell parent = load_cell(team, parents[i / 8], scratch);
  store_cell(team, field.child(team, parent, i % 8, scratch, schedule->margin), scratch,
             children[i]);
}

__global__ void insert_candidates(ListedSpheres spheres, const Candidate* candidates, int count,
                                  BandSchedule* schedule, std::uint32_t* bucket) {
  if (threadIdx.x >= 32) return;
  const WarpTeam team;
  const CandidateBuckets buckets = candidate_buckets(schedule->threshold, 1);
  std::uint64_t inserted = 0;
  for (int i = 0; i < count; ++i) {
    const Candidate& c = candidates[i];
    const float r = certified_radius(team, c.centre, c.radius, 1.0, spheres);
    if (team.lane() != 0) continue;
    bucket[i] = buckets.bucket_of(c.centre, 0, 0, 0);
    if (i > 0 && goes_before(candidates[i - 1], c) && overlap(candidates[i - 1], c)) continue;
    if (!schedule->accepts(r) || schedule->stopped) continue;
    schedule->insert(r);
    ++inserted;
  }
  if (team.lane() != 0 || schedule->end_round(inserted)) return;
  schedule->end_band();
  schedule->begin_cleaning();
  schedule->begin_band(schedule->threshold);
}

__global__ void relate(SphereGridLayout layout, Sphere sphere, GridRelation* relations) {
  const GridRange range = grid_range(layout, sphere);
  const int i = range.lo[0] + static_cast<int>(threadIdx.x);
  relations[threadIdx.x] = block_relation(layout, sphere, i / 8, 0, 0) == GridRelation::near
                               ? cell_relation(layout, sphere, i, 0, 0)
                               : GridRelation::away;
}

}  // namespace

/// Keeps the kernels above.
const void* packing_numerics_kernels(int i) {
  switch (i) {
    case 0:
      return reinterpret_cast<const void*>(work_on_cells);
    case 1:
      return reinterpret_cast<const void*>(split_cells);
    case 2:
      return reinterpret_cast<const void*>(insert_candidates);
    default:
      return reinterpret_cast<const void*>(relate);
  }
}

}  // namespace ist::gpu
