#include "spheres/cover_search.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

#include "numerics/hashing.h"
#include "spheres/cell_key.h"
#include "spheres/cover_choice.h"
#include "spheres/cover_descent.h"
#include "spheres/cover_proof.h"
#include "spheres/offset_surface.h"
#include "spheres/protrusion.h"

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr int kAttempts = 2;      ///< searches, of which the best counts
constexpr int kCuts = 14;         ///< rounds of descending and looking what was missed
constexpr int kFirstRounds = 25;  ///< over all balls, before the first look
constexpr int kRounds = 8;        ///< between two looks
constexpr std::size_t kExchanges = 1500;
constexpr std::int64_t kSteps = 400'000'000;   ///< of all exchanges of an attempt
constexpr std::size_t kOpenParts = 1'000'000;  ///< that a look takes in, about
constexpr int kLevels = 24;                    ///< that exchanges try
constexpr double kFinest = 1e-3;  ///< of the level: how close the last radii are to just enough

std::vector<CoverSphere> balls_at(const OffsetSurface& surface,
                                  const std::vector<Vector3d>& centres) {
  std::vector<CoverSphere> balls;
  for (const Vector3d& c : centres)
    if (const double r = surface.radius(c); r > 0) balls.push_back({c, r});
  return balls;
}

std::vector<Vector3d> centres_of(const std::vector<CoverSphere>& balls,
                                 const std::vector<std::uint32_t>& chosen) {
  std::vector<Vector3d> centres;
  for (const std::uint32_t j : chosen) centres.push_back(balls[j].centre);
  return centres;
}

/// The first point of every cell of a grid.
std::vector<Vector3d> thinned(const std::vector<Vector3d>& points, double cell) {
  std::unordered_set<std::uint64_t> seen;
  std::vector<Vector3d> some;
  for (const Vector3d& p : points)
    if (seen.insert(cell_key(p, cell)).second) some.push_back(p);
  return some;
}

/// A cover at its level, its balls as they were looked at, and how far it may be wrong.
struct Looked {
  LevelCover cover;
  std::vector<CoverSphere> balls;
  double level = 0;  ///< that it has, but for what grows where little was missed
};

SampledSolid sampled_for(const MeshSolid& solid, std::size_t count) {
  return sample_solid(solid, std::clamp<std::size_t>(80 * count, 4000, 60000));
}

/// The lowest level at which a greedy choice of balls around the medial axis is enough.
LevelCover greedy_cover(const MeshSolid& solid, const SampledSolid& sampled, std::size_t count) {
  const std::vector<Vector3d> centres = OffsetSurface(solid, sampled, 0).medial_centres(800);
  const std::vector<Vector3d> targets = thinned(sampled.targets, 2 * sampled.spacing);
  double low = 1e-3, high = 1;
  LevelCover best;
  for (int k = 0; k < 7; ++k) {
    const double level = std::sqrt(low * high);
    const std::vector<CoverSphere> balls = balls_at(OffsetSurface(solid, sampled, level), centres);
    const std::vector<std::uint32_t> chosen = choose_greedily(balls, targets);
    if (!chosen.empty() && chosen.size() <= count) {
      best = {centres_of(balls, chosen), level};
      high = level;
    } else {
      low = level;
    }
  }
  // One ball around the cube of the frame holds anything.
  if (best.centres.empty()) best = {{Vector3d::Zero()}, 2};
  return best;
}

/// One search, on samples of its own.
class Attempt {
 public:
  Attempt(const MeshSolid& solid, const SampledSolid& sampled, std::uint64_t seed,
          const std::function<void()>& look)
      : solid_(solid), sampled_(sampled), seed_(seed), look_(look) {}

  Looked found(LevelCover start, std::size_t count) {
    Looked looked = settled(exchanged(std::move(start), count));
    grow_to_cover(solid_, looked.balls, kFinest * looked.cover.level);
    return looked;
  }

 private:
  /// Lowers the level as long as other candidates are found that are enough.
  LevelCover exchanged(LevelCover cover, std::size_t count) {
    std::vector<Vector3d> centres =
        OffsetSurface(solid_, sampled_, cover.level).medial_centres(2000);
    centres.insert(centres.end(), cover.centres.begin(), cover.centres.end());
    const std::vector<Vector3d> targets = thinned(sampled_.targets, 0.7 * cover.level);
    double factor = 0.9;
    std::int64_t steps = kSteps;
    for (int k = 0; k < kLevels && factor < 0.99 && steps > 0; ++k) {
      const double level = cover.level * factor;
      const std::vector<CoverSphere> balls =
          balls_at(OffsetSurface(solid_, sampled_, level), centres);
      const std::vector<std::uint32_t> chosen =
          choose_cover(balls, targets, count, kExchanges, ++seed_, steps);
      look_();
      if (chosen.empty()) {
        factor = std::sqrt(factor);
      } else {
        cover = {centres_of(balls, chosen), level};
      }
    }
    return cover;
  }

  /// Descends on samples and adds what they missed, until they miss little. The level holds then
  /// for the whole surface.
  Looked settled(LevelCover cover) {
    Looked best;
    double step = 0.08;
    for (int k = 0; k < kCuts; ++k) {
      cover = CoverDescent(solid_, sampled_).improve(cover, step, k == 0 ? kFirstRounds : kRounds);
      Looked looked = looked_at(cover);
      look_();
      const double missed = looked.level - cover.level;
      cover.level = looked.level;
      if (best.balls.empty() || looked.level < best.level) best = std::move(looked);
      if (cover.level > 1.2 * best.level)
        cover = {best.cover.centres, best.level};  // a ball is lost
      if (missed < 0.004 * cover.level) break;
      step = std::clamp(missed / cover.level, 0.02, 0.08);
    }
    return best;
  }

  /// What samples do not tell: places of the surface outside all balls become targets, and where
  /// balls reach further than the level, rays are added.
  Looked looked_at(const LevelCover& cover) {
    Looked looked{cover, {}, cover.level};
    const OffsetSurface surface(solid_, sampled_, cover.level);
    for (const Vector3d& c : cover.centres) looked.balls.push_back({c, surface.radius(c)});
    looked.level += std::max(add_targets(looked.balls, cover.level),
                             add_rays(surface, looked.balls, cover.level));
    return looked;
  }

  /// Returns how far the worst place is outside.
  double add_targets(const std::vector<CoverSphere>& balls, double level) {
    const std::size_t most = std::max<std::size_t>(16, kOpenParts / solid_.view().triangle_count);
    std::vector<OpenPart> parts = open_surface(solid_.view(), balls, 0.03 * level, most);
    std::stable_sort(parts.begin(), parts.end(),
                     [](const OpenPart& a, const OpenPart& b) { return a.gap > b.gap; });
    std::unordered_set<std::uint64_t> seen;
    for (const OpenPart& part : parts) {
      if (part.gap <= 0.002 * level) break;
      if (seen.insert(cell_key(part.middle, 0.15 * level)).second)
        sampled_.targets.push_back(part.middle);
    }
    return parts.empty() ? 0 : parts.front().gap;
  }

  /// Returns by how much the worst ball reaches too far.
  double add_rays(const OffsetSurface& surface, const std::vector<CoverSphere>& balls,
                  double level) {
    std::vector<std::vector<Vector3d>> beyond(balls.size());
    std::vector<double> further(balls.size(), 0);
    tbb::parallel_for(std::size_t{0}, balls.size(), [&](std::size_t i) {
      // What the distance alone vouches for needs no look.
      if (balls[i].radius <= surface.sure_radius(balls[i].centre) * (1 + 1e-9)) return;
      further[i] = ball_protrusion(solid_, balls[i], 0.05, 1.005 * level, &beyond[i]).least - level;
    });
    std::unordered_set<std::uint64_t> seen;
    for (const auto& points : beyond) {
      for (const Vector3d& p : points) {
        if (!seen.insert(cell_key(p, 0.2 * level)).second) continue;
        const ClosestPoint foot = solid_.closest_point(p);
        sampled_.rays.push_back({foot.point, (p - foot.point) / foot.distance, foot.distance});
      }
    }
    return std::max(0.0, *std::max_element(further.begin(), further.end()));
  }

  const MeshSolid& solid_;
  SampledSolid sampled_;
  std::uint64_t seed_;
  const std::function<void()>& look_;
};

/// Of the ball that reaches furthest; `enough` where none reaches so far.
double largest_protrusion(const MeshSolid& solid, const std::vector<CoverSphere>& balls,
                          double enough) {
  std::vector<double> most(balls.size());
  tbb::parallel_for(std::size_t{0}, balls.size(), [&](std::size_t i) {
    most[i] = ball_protrusion(solid, balls[i], 0.02, enough).most;
  });
  return std::max(enough, *std::max_element(most.begin(), most.end()));
}

}  // namespace

std::size_t CoverSearch::greedy_count(double level) const {
  const SampledSolid sampled = sampled_for(solid_, 64);
  const OffsetSurface surface(solid_, sampled, level);
  return choose_greedily(balls_at(surface, surface.medial_centres(3000)),
                         thinned(sampled.targets, 0.5 * level))
      .size();
}

std::vector<CoverSphere> CoverSearch::with_count(std::size_t count) const {
  const SampledSolid sampled = sampled_for(solid_, count);
  look_(0.1);
  const LevelCover start = greedy_cover(solid_, sampled, count);
  look_(0.2);
  const std::function<void()> look = [&] { look_(0.2); };
  std::vector<Looked> found(kAttempts);
  std::vector<double> largest(kAttempts);
  tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t k) {
    Attempt attempt(solid_, sampled, mixed(seed_ + k + 1), look);
    found[k] = attempt.found(start, count);
    largest[k] = largest_protrusion(solid_, found[k].balls, 0.95 * found[k].cover.level);
  });
  look_(0.95);
  const auto best = std::min_element(largest.begin(), largest.end()) - largest.begin();
  return found[static_cast<std::size_t>(best)].balls;
}

}  // namespace ist
