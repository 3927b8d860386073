#include "spheres/cover_search.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "spheres/cell_key.h"
#include "spheres/cover_choice.h"
#include "spheres/cover_proof.h"
#include "spheres/offset_surface.h"

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr int kRestarts = 3;
constexpr int kCuts = 8;
constexpr int kRounds = 25;
constexpr std::size_t kExchanges = 4000;

std::vector<CoverSphere> balls_at(const OffsetSurface& surface, const std::vector<Vector3d>& centres) {
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

/// Radii just large enough for the proof: what sticks out goes to the ball that grows least.
void grow_to_cover(const MeshSolid& solid, std::vector<CoverSphere>& balls, double finest) {
  for (int round = 0; round < 50; ++round) {
    const std::vector<OpenPart> parts = open_surface(solid.view(), balls, finest);
    if (!parts.empty()) {
      for (const OpenPart& part : parts) {
        double& radius = balls[part.ball].radius;
        radius = std::max(radius, part.radius);
      }
      continue;
    }
    const OpenPlace open = open_void(solid, balls);
    if (!open.found) return;
    CoverSphere* nearest = &balls.front();
    double least = 1e300;
    for (CoverSphere& ball : balls) {
      const double lacks = std::sqrt((open.place - ball.centre).squaredNorm()) - ball.radius;
      if (lacks < least) least = lacks, nearest = &ball;
    }
    nearest->radius += std::max(least, 0.0) + finest;
  }
}

}  // namespace

void CoverSearch::sample(std::size_t count) {
  sampled_ = sample_solid(solid_, std::clamp<std::size_t>(80 * count, 4000, 60000));
}

std::size_t CoverSearch::greedy_count(double level) {
  sample(64);
  const std::vector<Vector3d> centres = OffsetSurface(sampled_.rays, level).medial_centres(3000);
  const std::vector<CoverSphere> balls = balls_at(OffsetSurface(sampled_.rays, level), centres);
  return choose_greedily(balls, thinned(sampled_.targets, 0.5 * level)).size();
}

std::vector<CoverSphere> CoverSearch::with_count(std::size_t count) {
  sample(count);
  look_(0.1);
  LevelCover cover = greedy(count);
  look_(0.2);
  LevelCover best;
  for (int k = 0; k < kRestarts; ++k) {
    cover = settled(exchanged(cover, count, k == 0 ? 0.93 : 0.97));
    if (best.centres.empty() || cover.level < best.level) best = cover;
    cover = best;
    look_(0.2 + 0.7 * (k + 1) / kRestarts);
  }
  const OffsetSurface surface(sampled_.rays, best.level);
  std::vector<CoverSphere> balls = balls_at(surface, best.centres);
  grow_to_cover(solid_, balls, 1e-5);
  return balls;
}

/// The lowest level at which a greedy choice of balls around the medial axis is enough.
LevelCover CoverSearch::greedy(std::size_t count) {
  const std::vector<Vector3d> centres = OffsetSurface(sampled_.rays, 0).medial_centres(1500);
  const std::vector<Vector3d> targets = thinned(sampled_.targets, 2 * sampled_.spacing);
  double low = 1e-4, high = 2;
  LevelCover best;
  for (int k = 0; k < 12; ++k) {
    const double level = std::sqrt(low * high);
    const std::vector<CoverSphere> balls = balls_at(OffsetSurface(sampled_.rays, level), centres);
    const std::vector<std::uint32_t> chosen = choose_greedily(balls, targets);
    if (!chosen.empty() && chosen.size() <= count) {
      best = {centres_of(balls, chosen), level};
      high = level;
    } else {
      low = level;
    }
  }
  if (best.centres.empty()) best = {{Vector3d::Zero()}, 2};
  return best;
}

LevelCover CoverSearch::exchanged(LevelCover cover, std::size_t count, double factor) {
  std::vector<Vector3d> centres = OffsetSurface(sampled_.rays, cover.level).medial_centres(3000);
  centres.insert(centres.end(), cover.centres.begin(), cover.centres.end());
  const std::vector<Vector3d> targets = thinned(sampled_.targets, 0.5 * cover.level);
  for (;;) {
    const double level = cover.level * factor;
    const std::vector<CoverSphere> balls = balls_at(OffsetSurface(sampled_.rays, level), centres);
    const std::vector<std::uint32_t> chosen =
        choose_cover(balls, targets, count, kExchanges, ++seed_);
    look_(0);
    if (chosen.empty()) return cover;
    cover = {centres_of(balls, chosen), level};
  }
}

/// Descends on samples and adds what they missed, until they miss little. The level holds then for
/// the whole surface.
LevelCover CoverSearch::settled(LevelCover cover) {
  LevelCover best;
  double step = 0.08;
  for (int k = 0; k < kCuts; ++k) {
    cover = CoverDescent(sampled_.rays, sampled_.targets).improve(cover, step, kRounds);
    const double missed = add_missed(cover);
    look_(0);
    const bool close = missed < 0.004 * cover.level;
    cover.level += missed;
    if (best.centres.empty() || cover.level < best.level) best = cover;
    if (close) break;
    step = std::clamp(missed / cover.level, 0.02, 0.08);
  }
  return best;
}

/// Places of the surface outside all balls become targets. Returns how far the worst is outside.
double CoverSearch::add_missed(const LevelCover& cover) {
  const OffsetSurface surface(sampled_.rays, cover.level);
  std::vector<CoverSphere> balls;
  for (const Vector3d& c : cover.centres) balls.push_back({c, surface.radius(c)});
  std::vector<OpenPart> parts = open_surface(solid_.view(), balls, 0.03 * cover.level);
  std::stable_sort(parts.begin(), parts.end(),
                   [](const OpenPart& a, const OpenPart& b) { return a.gap > b.gap; });
  std::unordered_set<std::uint64_t> seen;
  for (const OpenPart& part : parts) {
    if (part.gap <= 0.002 * cover.level) break;
    if (seen.insert(cell_key(part.middle, 0.3 * cover.level)).second)
      sampled_.targets.push_back(part.middle);
  }
  return parts.empty() ? 0 : parts.front().gap;
}

}  // namespace ist
