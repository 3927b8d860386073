#include <ist/cover_spheres.h>
#include <ist/types.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "base/stage.h"
#include "base/thread_arena.h"
#include "mesh/mesh_solid.h"
#include "robots/covers/cover_proof.h"
#include "robots/covers/cover_search.h"

namespace ist {
namespace {

/// Equal meshes with the same number of spheres, and their covers by count.
struct CoverPart {
  const ClosedMesh* mesh;
  std::size_t count;           ///< 0: a share of the total
  std::size_t copies;          ///< meshes
  const ProtrusionRoom* room;  ///< null: none
  std::map<std::size_t, SphereCover> tried = {};
};

inline constexpr int kSharingRounds = 6;  ///< at most

bool equal(const ClosedMesh& a, const ClosedMesh& b) {
  return a.mesh.triangles == b.mesh.triangles && a.mesh.vertices == b.mesh.vertices;
}

/// Adds to `parts`, for each mesh, the part that it belongs to; returns the part's index for each.
std::vector<std::size_t> parts_of(std::span<const ClosedMesh> meshes,
                                  const SphereCoverSettings& settings,
                                  std::vector<CoverPart>& parts) {
  std::vector<std::size_t> part_of;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    std::size_t count = settings.counts.empty() ? 0 : settings.counts[i];
    if (count == 0 && settings.total == 0) count = settings.count;
    const auto* const room =
        settings.room.empty() || !settings.room[i] ? nullptr : &settings.room[i];
    const auto found = std::find_if(parts.begin(), parts.end(), [&](const CoverPart& part) {
      return part.count == count && part.room == room && equal(*part.mesh, meshes[i]);
    });
    part_of.push_back(static_cast<std::size_t>(found - parts.begin()));
    if (found == parts.end())
      parts.push_back({&meshes[i], count, 1, room});
    else
      ++found->copies;
  }
  return part_of;
}

/// Distributes the total among the parts without a count: evenly at first, then by the measured
/// protrusions. Returns the counts whose largest protrusion was the smallest.
///
/// `cover(counts)` must cover each part with so many spheres. Throws Error if the total is too
/// small.
std::vector<std::size_t> shared_counts(
    const std::vector<CoverPart>& parts, std::size_t total,
    const std::function<void(const std::vector<std::size_t>&)>& cover) {
  std::vector<std::size_t> counts, copies, open;
  std::size_t fixed = 0, sharers = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    counts.push_back(parts[i].count);
    fixed += parts[i].count * parts[i].copies;
    if (parts[i].count != 0) continue;
    open.push_back(i);
    copies.push_back(parts[i].copies);
    sharers += parts[i].copies;
  }
  if (total < fixed + sharers)
    throw Error("cover: a total of " + std::to_string(total) + " spheres is too small: at least " +
                std::to_string(fixed + sharers) + " are needed. Increase it");
  const std::size_t left = total - fixed;
  std::vector<std::size_t> shares(
      open.size(), std::min(kMostCoverSpheres, left / std::max<std::size_t>(1, sharers)));
  std::vector<std::size_t> best;
  std::vector<double> least;  // protrusions, the largest first
  for (int round = 0; round < kSharingRounds; ++round) {
    for (std::size_t k = 0; k < open.size(); ++k) counts[open[k]] = shares[k];
    cover(counts);
    std::vector<TriedCounts> tried;
    std::vector<double> reached;
    for (std::size_t k = 0; k < open.size(); ++k) {
      tried.emplace_back();
      for (const auto& [count, found] : parts[open[k]].tried)
        tried.back()[count] = found.protrusion.largest;
      reached.push_back(estimated_protrusion(tried[k], shares[k]));
    }
    std::sort(reached.rbegin(), reached.rend());
    if (best.empty() || reached < least) {
      least = reached;
      best = counts;
    }
    std::vector<std::size_t> next = share_out(tried, copies, left);
    if (next == shares) break;
    shares = std::move(next);
  }
  return best;
}

using Eigen::Vector3d;

constexpr int kMostTries = 8;  ///< counts that are tried for a protrusion; doubling goes on
/// with a margin: level at first, over that of a plain choice's balls
constexpr double kOfGuess = 1;
constexpr int kRoomTries = 2;    ///< with a margin: counts that are tried
constexpr double kAbout = 1.25;  ///< with a margin: times the level that are good enough

/// The joint progress of several searches, reported by the thread that started them.
class Watch {
 public:
  Watch(const ProgressCallback& progress, std::size_t searches)
      : stage_("spheres", progress), searches_(searches) {}

  /// Advances one search's share from `before` to `now`. Throws WorkStop::Stopped.
  void look(double before, double now) {
    double done = done_.load();
    while (!done_.compare_exchange_weak(done, done + (now - before))) {
    }
    if (std::this_thread::get_id() == caller_) {
      const double share = std::min(1.0, done_.load() / static_cast<double>(searches_));
      const auto stopped = stage_.stop([&](Progress& report) { report.fraction = share; });
      if (stopped) stop_.stop();
    }
    stop_.look();
  }

 private:
  Stage stage_;
  const std::size_t searches_;
  const std::thread::id caller_ = std::this_thread::get_id();
  std::atomic<double> done_ = 0;
  WorkStop stop_;
};

/// The sphere in the mesh's frame, enlarged by the rounding of its centre.
CoverSphere in_mesh_frame(const CoverSphere& ball, const UnitFrame& frame) {
  const Vector3d centre = frame.from_unit(ball.centre);
  const double moved =
      0x1p-51 * (std::abs(centre.x()) + std::abs(centre.y()) + std::abs(centre.z()));
  return {centre, ball.radius * frame.scale() + moved};
}

std::vector<CoverSphere> in_unit_frame(std::span<const CoverSphere> spheres,
                                       const UnitFrame& frame) {
  std::vector<CoverSphere> balls;
  for (const CoverSphere& s : spheres) {
    if (!(s.radius > 0) || !std::isfinite(s.radius) || !s.centre.allFinite()) continue;
    balls.push_back({frame.to_unit(s.centre), s.radius / frame.scale()});
  }
  return balls;
}

SphereProtrusion in_mesh_frame(SphereProtrusion p, const UnitFrame& frame) {
  for (double* length : {&p.largest, &p.largest_seen, &p.mean, &p.p95}) *length *= frame.scale();
  return p;
}

void check(const SphereCoverSettings& settings, std::size_t meshes) {
  if (!settings.counts.empty() && settings.counts.size() != meshes)
    throw Error("cover: " + std::to_string(settings.counts.size()) + " counts for " +
                std::to_string(meshes) + " meshes");
  std::vector<std::size_t> counts = settings.counts;
  std::erase(counts, 0);
  counts.push_back(settings.count);
  for (const std::size_t count : counts)
    if (count < 1 || count > kMostCoverSpheres)
      throw Error("cover: " + std::to_string(count) +
                  " spheres requested; the count must be 1 to " +
                  std::to_string(kMostCoverSpheres));
  if (!(settings.max_protrusion >= 0) || !std::isfinite(settings.max_protrusion))
    throw Error("cover: the largest protrusion must be finite and 0 or more");
  if (settings.total > 0 && settings.max_protrusion > 0)
    throw Error("cover: total and max_protrusion exclude each other");
  if (settings.room.empty()) return;
  if (settings.max_protrusion == 0) throw Error("cover: room needs max_protrusion");
  if (settings.room.size() != meshes)
    throw Error("cover: room of " + std::to_string(settings.room.size()) + " meshes for " +
                std::to_string(meshes));
}

SphereCover finished(const MeshSolid& solid, const std::vector<CoverSphere>& balls) {
  SphereCover cover;
  for (const CoverSphere& ball : balls) cover.spheres.push_back(in_mesh_frame(ball, solid.frame()));
  cover.protrusion = in_mesh_frame(protrusion_of(solid, balls), solid.frame());
  return cover;
}

constexpr double kLeastShare = 0.05;      ///< of the level: smaller margins are given up
constexpr double kLeastEstimated = 1e-3;  ///< the same where spheres are only counted

/// `room`: the free distances, as fractions of `most`, of at least `least`; null: none.
CoverSearch search_of(const MeshSolid& solid, std::uint64_t seed, std::function<void(double)> look,
                      double most, const ProtrusionRoom& room, double least) {
  if (!room) return {solid, seed, std::move(look)};
  return {solid, seed, std::move(look),
          [&room, most, least, &solid](const Vector3d& place, const Vector3d& outward) {
            return std::clamp(room(solid.frame().from_unit(place), outward) / most, least, 1.0);
          },
          most / solid.frame().scale()};
}

/// The fewest spheres with a sufficiently small protrusion: doubles the count until it is enough,
/// then bisects.
SphereCover fewest(const MeshSolid& solid, const CoverSearch& search,
                   const SphereCoverSettings& settings, bool room) {
  int tries = 0;
  const double level = settings.max_protrusion / solid.frame().scale();
  // to the level, with a margin
  LeveledBalls nearest = {{}, std::numeric_limits<double>::infinity()};
  const auto with = [&](std::size_t count) {
    ++tries;
    const LeveledBalls found = search.with_count(count);
    if (room && found.level < nearest.level) nearest = found;
    SphereCover cover = finished(solid, room ? nearest.balls : found.balls);
    cover.reached = room ? nearest.level <= kAbout * level
                         : cover.protrusion.largest <= settings.max_protrusion;
    return cover;
  };
  const std::size_t guess = search.greedy_count(level);
  std::size_t low = 0;  // too few
  const auto first = static_cast<std::size_t>((room ? kOfGuess : 0.5) * static_cast<double>(guess));
  std::size_t high = std::clamp<std::size_t>(first, 1, settings.count);
  SphereCover best = with(high);
  while (!best.reached && high < settings.count && !(room && tries == kRoomTries)) {
    low = high;
    high = std::min(settings.count, room ? high + high / 4 + 1 : 2 * high);
    best = with(high);
  }
  if (room || !best.reached) return best;
  while (high - low > std::max<std::size_t>(1, high / 16) && tries < kMostTries) {
    const std::size_t middle = (low + high) / 2;
    SphereCover fewer = with(middle);
    if (fewer.reached) {
      best = std::move(fewer);
      high = middle;
    } else {
      low = middle;
    }
  }
  return best;
}

SphereCover cover_one(const CoverPart& part, const SphereCoverSettings& settings, Watch& watch) {
  const auto start = std::chrono::steady_clock::now();
  const MeshSolid solid(*part.mesh);
  std::atomic<double> done = 0;
  const ProtrusionRoom none;
  const CoverSearch search = search_of(
      solid, settings.seed,
      [&](double share) {
        const double before = done.load();
        if (share > before) done = share;  // one thread at a time advances
        watch.look(before, std::max(before, share));
      },
      settings.max_protrusion, part.room == nullptr ? none : *part.room, kLeastShare);
  SphereCover cover = settings.max_protrusion > 0
                          ? fewest(solid, search, settings, part.room != nullptr)
                          : finished(solid, search.with_count(settings.count).balls);
  watch.look(done, 1);
  cover.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return cover;
}

/// Covers each part with so many spheres, unless that was tried.
void try_counts(std::vector<CoverPart>& parts, const std::vector<std::size_t>& counts,
                const SphereCoverSettings& settings, Watch& watch) {
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, parts.size(), 1),
      [&](const tbb::blocked_range<std::size_t>& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          SphereCoverSettings own = settings;
          own.count = counts[i];
          if (parts[i].tried.contains(own.count))
            watch.look(0, 1);
          else
            parts[i].tried[own.count] = cover_one(parts[i], own, watch);
        }
      },
      tbb::simple_partitioner());
}

}  // namespace

std::vector<SphereCover> cover_with_spheres(std::span<const ClosedMesh> meshes,
                                            const SphereCoverSettings& settings,
                                            const ProgressCallback& progress) {
  check(settings, meshes.size());
  std::vector<CoverPart> parts;
  const std::vector<std::size_t> part_of = parts_of(meshes, settings, parts);
  Watch watch(progress, parts.size() * (settings.total > 0 ? kSharingRounds : 1));
  std::vector<std::size_t> counts;
  for (const CoverPart& part : parts) counts.push_back(part.count);
  try {
    thread_arena(settings.threads).execute([&] {
      if (settings.total > 0)
        counts = shared_counts(parts, settings.total, [&](const std::vector<std::size_t>& tried) {
          try_counts(parts, tried, settings, watch);
        });
      else
        try_counts(parts, counts, settings, watch);
    });
  } catch (const WorkStop::Stopped&) {
    throw Error("spheres: cancelled");
  }
  std::vector<SphereCover> covers;
  for (const std::size_t i : part_of) {
    // Fewer spheres may protrude less: the search is a heuristic.
    const auto end = parts[i].tried.upper_bound(counts[i]);
    const auto best =
        std::min_element(parts[i].tried.begin(), end, [](const auto& a, const auto& b) {
          return a.second.protrusion.largest < b.second.protrusion.largest;
        });
    covers.push_back(best->second);
    best->second.seconds = 0;
  }
  return covers;
}

SphereCover cover_with_spheres(const ClosedMesh& mesh, const SphereCoverSettings& settings,
                               const ProgressCallback& progress) {
  return cover_with_spheres(std::span(&mesh, 1), settings, progress).front();
}

std::size_t estimated_count(const ClosedMesh& mesh, double max_protrusion,
                            const ProtrusionRoom& room, std::size_t enough) {
  const MeshSolid solid(mesh);
  return search_of(
             solid, 0, [](double) {}, max_protrusion, room, kLeastEstimated)
      .greedy_count(max_protrusion / solid.frame().scale(), enough);
}

SphereCoverProof prove_cover(const ClosedMesh& mesh, std::span<const CoverSphere> spheres) {
  const MeshSolid solid(mesh);
  const std::vector<CoverSphere> balls = in_unit_frame(spheres, solid.frame());
  SphereCoverProof proof;
  const auto refuted = [&](const Vector3d& place, double gap) {
    proof.where = solid.frame().from_unit(place);
    proof.gap = gap * solid.frame().scale();
    return proof;
  };
  const std::vector<OpenPart> parts = open_surface(solid.view(), balls, 1e-9, 1);
  if (!parts.empty()) {
    const auto worst =
        std::max_element(parts.begin(), parts.end(),
                         [](const OpenPart& a, const OpenPart& b) { return a.gap < b.gap; });
    return refuted(worst->middle, worst->gap);
  }
  const OpenPlace open = open_void(solid, balls);
  if (open.found) return refuted(open.place, open.gap);
  proof.covered = true;
  return proof;
}

SphereProtrusion sphere_protrusion(const ClosedMesh& mesh, std::span<const CoverSphere> spheres) {
  const MeshSolid solid(mesh);
  return in_mesh_frame(protrusion_of(solid, in_unit_frame(spheres, solid.frame())), solid.frame());
}

}  // namespace ist
