#pragma once

#include <ist/bake.h>
#include <algorithm>

#include "base/stage.h"
#include "mesh/mesh_solid.h"
#include "packing/base/certificate.h"
#include "packing/base/packing_settings.h"
#include "packing/grids/ascent.h"
#include "packing/grids/distance_grid.h"

namespace ist::packing {

/// The data from which automatic grid sizes are derived.
struct GridFigures {
  double lower[3] = {}, upper[3] = {};  ///< bounds of the solid, unit frame
  double volume = 0;                    ///< unit frame³
  std::size_t triangles = 0;
  std::size_t memory = 0;  ///< [bytes] that the grids may take
};

/// The two grids of a mode over the rounds (docs/design.md 4.1): levels of one first grid's
/// refinements. The prototype grid's levels determine the packing, so they depend on mesh and
/// settings only; the distance grid's levels affect only the speed, and also depend on the free
/// memory.
struct GridSchedule {
  GridLayout first;           ///< level 0
  int prototypes = 0;         ///< level of the prototype grid at the start
  int finest_prototypes = 0;  ///< and at the end
  int distances = 0;          ///< level of the distance grid at the start
  int finest_distances = 0;   ///< and at the end
  int rounds_per_level = 2;

  GridLayout level(int l) const {
    GridLayout g = first;
    for (; l > 0; --l) g = refined(g);
    return g;
  }
};

/// Cells on the longest side of a distance grid that suits so many triangles; finer ones are
/// slower.
int distance_resolution(const GridFigures& solid);

/// Throws Error if settings require more cells than possible.
GridSchedule grid_schedule(GridMode mode, const GridSettings& settings, const GridFigures& solid);

// Float distances to a grid's lists are accurate to a few 2^-23: smaller radii cannot be resolved.
// The banded mode certifies as it proceeds, and goes down to a quarter of it.
constexpr float kSmallestGridRadius = 0x1p-21f;
constexpr int kIdleRounds =
    3;  ///< without a sphere at the finest grids: then no further sphere fits

/// The paper's algorithm (§3, §4; docs/design.md 4.1), the same for all four schedules, on the host
/// or a device: `Rounds` as in ascent.h.
template <class Rounds>
class GridPacker {
 public:
  GridPacker(Rounds& rounds, const GridSchedule& schedule, const PackingLimits& limits,
             Stage& stage)
      : rounds_(rounds),
        schedule_(schedule),
        limits_(limits),
        stage_(stage),
        prototypes_(schedule.level(schedule.prototypes)),
        distances_(schedule.distances) {}

  SpherePacking run() {
    rounds_.build(schedule_.level(distances_));
    rounds_.place_prototypes(prototypes_);
    int rounds_at_level = 0, idle = 0;
    while (goes_on()) {
      const bool any = round();
      if (stopped_) break;
      idle = any ? 0 : idle + 1;
      ++rounds_at_level;
      if (prototypes_.level < schedule_.finest_prototypes &&
          (rounds_at_level >= schedule_.rounds_per_level || !any)) {
        refine();
        rounds_at_level = idle = 0;
      } else if (any) {
        rounds_.update();
      } else if (idle == kIdleRounds) {
        stop(rounded_up(limits_.min_radius) > kSmallestGridRadius ? StopReason::min_radius
                                                                  : StopReason::exhausted);
      }
    }
    result_.stop = reason_;
    result_.coverage = coverage();
    return std::move(result_);
  }

 private:
  /// Inserts the winners of one set of prototypes; false if there are none.
  bool round() {
    const float smallest = std::max(kSmallestGridRadius, rounded_up(limits_.min_radius));
    std::vector<GridWinner> winners = rounds_.round(
        {prototypes_, limits_.seed, static_cast<std::uint32_t>(result_.rounds), smallest},
        [this] { return goes_on(); });
    if (stopped_) return false;
    std::sort(winners.begin(), winners.end(), [](const GridWinner& a, const GridWinner& b) {
      return goes_before(a.candidate, b.candidate);
    });
    std::vector<Sphere> inserted;
    for (const GridWinner& w : winners) {
      const float r = rounded_down(w.radius);
      if (!(r >= smallest)) continue;
      if (r < kFloatNoise) result_.below_float_noise = true;
      inserted.push_back({w.candidate.centre.x, w.candidate.centre.y, w.candidate.centre.z, r});
      radius_ = inserted.front().r;
      result_.spheres.push_back(inserted.back());
      covered_ += fixed_ball_volume(r, volume_unit_);
      if (result_.spheres.size() == limits_.max_spheres)
        stop(StopReason::sphere_count);
      else if (coverage() >= limits_.target_coverage)
        stop(StopReason::coverage);
      if (stopped_) break;
    }
    ++result_.rounds;
    if (!stopped_) rounds_.append(inserted);
    return !inserted.empty();
  }

  /// Splits the prototype grid; refines the distance grid if it would be the coarser one.
  void refine() {
    prototypes_ = refined(prototypes_);
    if (distances_ < std::min(schedule_.finest_distances, prototypes_.level)) {
      ++distances_;
      rounds_.build(schedule_.level(distances_));
    } else {
      rounds_.update();
    }
    rounds_.split_prototypes();
  }

  double coverage() const {
    return std::min(1.0, static_cast<double>(covered_) * volume_unit_ / limits_.volume);
  }

  void stop(StopReason reason) {
    stopped_ = true;
    reason_ = reason;
  }

  /// Checks the time limit, and calls the user's callback ten times a second.
  bool goes_on() {
    if (stopped_) return false;
    const auto why = stage_.stop([this](Progress& now) {
      set_progress(now, limits_, result_.spheres.size(), coverage(), double{radius_});
    });
    if (why) stop(*why);
    return !stopped_;
  }

  Rounds& rounds_;
  const GridSchedule& schedule_;
  const PackingLimits& limits_;
  Stage& stage_;
  GridLayout prototypes_;
  int distances_;
  SpherePacking result_;
  double volume_unit_ = volume_unit_of(limits_.volume);
  std::uint64_t covered_ = 0;  ///< in volume_unit_
  float radius_ = 0;
  bool stopped_ = false;
  StopReason reason_ = StopReason::exhausted;
};

/// The data from which grid sizes are derived; `memory` [bytes] for the grids.
GridFigures grid_figures(const MeshSolid& solid, std::size_t memory);

/// Packs a mesh on the paper's grids (settings.grid, not banded) by a host's or a device's rounds.
template <class Rounds>
SpherePacking pack_grids_by(Rounds&& rounds, const MeshSolid& solid,
                            const PackingSettings& settings, std::size_t memory, Stage& stage) {
  const GridSchedule schedule =
      grid_schedule(settings.grid, settings.grids, grid_figures(solid, memory));
  const PackingLimits limits = packing_limits(solid, solid.frame().scale(), settings);
  return GridPacker(rounds, schedule, limits, stage).run();
}

/// The same with the threads of the current arena.
SpherePacking pack_grids(const MeshSolid& solid, const PackingSettings& settings, Stage& stage);

/// Grids of prototypes and distances of a medial axis. Automatic: for milliseconds on a GPU.
struct MedialGrids {
  GridLayout prototypes, distances;
};
MedialGrids medial_grids(const MeshSolid& mesh, unsigned resolution);

/// The nodes among converged prototypes, in the mesh's frame, ordered by cell.
std::vector<MedialNode> medial_nodes_of(std::vector<GridCandidate> converged,
                                        const UnitFrame& frame);

/// medial_nodes() with the rounds of a host or a device (ascent.h).
template <class Rounds>
std::vector<MedialNode> medial_nodes_by(Rounds&& rounds, const MeshSolid& mesh,
                                        const MedialSettings& settings) {
  const MedialGrids grids = medial_grids(mesh, settings.resolution);
  AscentSettings ascent;
  ascent.layout = grids.prototypes;
  ascent.seed = settings.seed;
  rounds.build(grids.distances);
  rounds.place_prototypes(ascent.layout);
  return medial_nodes_of(rounds.converged(ascent, [] { return true; }), mesh.frame());
}

/// The same with the threads of the current arena.
std::vector<MedialNode> medial_nodes_on_host(const MeshSolid& mesh, const MedialSettings& settings);

}  // namespace ist::packing
