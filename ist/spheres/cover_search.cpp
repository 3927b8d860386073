#include "spheres/cover_search.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>
#include <utility>

#include "numerics/hashing.h"
#include "spheres/cover_choice.h"
#include "spheres/cover_descent.h"
#include "spheres/cover_proof.h"
#include "spheres/offset_surface.h"
#include "spheres/point_grid.h"
#include "spheres/protrusion.h"

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr int kPasses = 3;                 ///< of exchanges and descent, of which the best counts
constexpr int kRounds = 120;               ///< of a descent, over all balls
constexpr std::size_t kTargetsABall = 60;  ///< on faces
constexpr std::size_t kCandidates = 1200;  ///< that exchanges choose from, about
constexpr double kThinning = 0.3;          ///< levels between targets that exchanges look at
constexpr std::size_t kExchanges = 1500;   ///< at a level
constexpr std::int64_t kSteps = 100'000'000;  ///< of all exchanges of a pass
constexpr int kLevels = 24;                   ///< that exchanges try
constexpr double kFinest = 1e-3;  ///< of the level: how close the last radii are to just enough

/// Centres of candidates, and how deep they lie.
struct Candidates {
  Candidates(const MeshSolid& solid, std::vector<Vector3d> places)
      : centres(std::move(places)), depths(centres.size()) {
    tbb::parallel_for(std::size_t{0}, centres.size(),
                      [&](std::size_t i) { depths[i] = depth_in(solid, centres[i]); });
  }

  /// The largest balls around them, those that there are.
  std::vector<CoverSphere> balls_at(const OffsetSurface& surface) const {
    std::vector<CoverSphere> balls;
    for (std::size_t i = 0; i < centres.size(); ++i)
      if (const double r = surface.radius(centres[i], depths[i]); r > 0)
        balls.push_back({centres[i], r});
    return balls;
  }

  std::vector<Vector3d> centres;
  std::vector<double> depths;
};

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

SampledSolid sampled_for(const MeshSolid& solid, std::size_t count) {
  return sample_solid(solid, std::clamp<std::size_t>(kTargetsABall * count, 1000, 60000));
}

/// The lowest level at which a greedy choice of balls around the medial axis is enough.
LevelCover greedy_cover(const MeshSolid& solid, const SampledSolid& sampled, std::size_t count) {
  const Candidates candidates(solid, OffsetSurface(solid, sampled, 0).medial_centres(800));
  const std::vector<Vector3d> targets = thinned(sampled.targets, 2 * sampled.spacing);
  double low = 1e-3, high = 1;
  LevelCover best;
  for (int k = 0; k < 7; ++k) {
    const double level = std::sqrt(low * high);
    const std::vector<CoverSphere> balls =
        candidates.balls_at(OffsetSurface(solid, sampled, level));
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

/// Lowers the level, at first by the share `step`, as long as other candidates are found that are
/// enough.
LevelCover exchanged(const MeshSolid& solid, const SampledSolid& sampled, LevelCover cover,
                     std::size_t count, double step, std::uint64_t seed,
                     const std::function<void()>& look) {
  std::vector<Vector3d> centres =
      OffsetSurface(solid, sampled, cover.level).medial_centres(kCandidates);
  centres.insert(centres.end(), cover.centres.begin(), cover.centres.end());
  const Candidates candidates(solid, std::move(centres));
  const std::vector<Vector3d> targets = thinned(sampled.targets, kThinning * cover.level);
  double factor = 1 - step;
  std::int64_t steps = kSteps;
  for (int k = 0; k < kLevels && factor < 0.99 && steps > 0; ++k) {
    const double level = cover.level * factor;
    const std::vector<CoverSphere> balls =
        candidates.balls_at(OffsetSurface(solid, sampled, level));
    const std::vector<std::uint32_t> chosen =
        choose_cover(balls, targets, count, kExchanges, ++seed, steps);
    look();
    if (chosen.empty())
      factor = std::sqrt(factor);
    else
      cover = {centres_of(balls, chosen), level};
  }
  return cover;
}

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
  return choose_greedily(Candidates(solid_, surface.medial_centres(3000)).balls_at(surface),
                         thinned(sampled.targets, 0.5 * level))
      .size();
}

std::vector<CoverSphere> CoverSearch::with_count(std::size_t count) const {
  SampledSolid sampled = sampled_for(solid_, count);
  look_(0.1);
  LevelCover start = greedy_cover(solid_, sampled, count);
  std::vector<CoverSphere> best;
  double least = std::numeric_limits<double>::infinity();
  for (int pass = 0; pass < kPasses; ++pass) {
    const double share = 0.2 + 0.7 * pass / kPasses;
    const std::function<void()> look = [&] { look_(share); };
    look();
    // Samples alone know no level as low as it is called; after a descent it is that of the
    // surface.
    const double step = pass == 0 ? 0.1 : 0.05;
    const double before = start.level;
    start = exchanged(solid_, sampled, std::move(start), count, step,
                      mixed(seed_ + static_cast<std::uint64_t>(pass) + 1), look);
    if (start.level == before && pass > 0) break;
    LookedCover looked = CoverDescent(solid_, sampled).improve(std::move(start), kRounds, look);
    grow_to_cover(solid_, looked.balls, kFinest * looked.cover.level);
    const double largest = largest_protrusion(solid_, looked.balls, 1.01 * looked.cover.level);
    start = std::move(looked.cover);
    if (largest < least) {
      least = largest;
      best = std::move(looked.balls);
    }
  }
  look_(0.95);
  return best;
}

}  // namespace ist
