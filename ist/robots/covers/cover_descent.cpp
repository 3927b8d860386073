#include "robots/covers/cover_search.h"

#include <ist/cover_spheres.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <unordered_set>
#include <vector>

#include "mesh/geometry/mesh_view.h"
#include "robots/covers/cover_proof.h"
#include "robots/covers/point_grid.h"
#include "robots/covers/triangles.h"

namespace ist {
namespace {

using Eigen::Vector3d;

/// A place on the surface outside all balls.
struct OpenCorner {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< unit frame
  double gap = 0;                                   ///< unit frame, > 0: to the nearest ball
};

using Corners = std::array<Vector3d, 3>;
using Polygon = std::vector<Vector3d>;

template <class Points>
bool holds(const CoverSphere& ball, const Points& points) {
  const double within2 = ball.radius * ball.radius;
  return std::all_of(points.begin(), points.end(),
                     [&](const Vector3d& p) { return (p - ball.centre).squaredNorm() <= within2; });
}

class Cutter {
 public:
  /// Cuts triangles within a box.
  Cutter(std::span<const CoverSphere> balls, const Eigen::AlignedBox3d& box) : balls_(balls) {
    for (std::uint32_t i = 0; i < balls.size(); ++i)
      if (box.squaredExteriorDistance(balls[i].centre) <= balls[i].radius * balls[i].radius)
        touching_.push_back(i);
  }

  /// `holder`: tried first, and set to the ball that contains the whole triangle.
  void cut(const Corners& triangle, std::uint32_t& holder, std::vector<OpenCorner>& out) {
    if (holder < balls_.size() && holds(balls_[holder], triangle)) return;
    const Vector3d middle = (triangle[0] + triangle[1] + triangle[2]) / 3;
    double reach2 = 0;
    for (const Vector3d& corner : triangle)
      reach2 = std::max(reach2, (corner - middle).squaredNorm());
    const double reach = std::sqrt(reach2);
    near_.clear();
    for (const std::uint32_t i : touching_) {
      const double d2 = (middle - balls_[i].centre).squaredNorm();
      const double touching = balls_[i].radius + reach;
      if (!(balls_[i].radius > 0) || d2 > touching * touching) continue;
      if (d2 <= balls_[i].radius * balls_[i].radius && holds(balls_[i], triangle)) {
        holder = i;
        return;
      }
      near_.push_back(i);
    }
    if (near_.empty()) {
      for (const Vector3d& corner : triangle) emit(corner, out);
      return;
    }
    for (const std::uint32_t i : near_) {
      piece_.assign(triangle.begin(), triangle.end());
      if (!cut_to_cell(i)) continue;
      for (const Vector3d& corner : piece_)
        if ((corner - balls_[i].centre).squaredNorm() > balls_[i].radius * balls_[i].radius)
          emit(corner, out);
    }
  }

 private:
  /// Clips the piece to the ball's cell; false if nothing is left, or if the ball contains it.
  bool cut_to_cell(std::uint32_t i) {
    const CoverSphere& own = balls_[i];
    const double own_power = own.centre.squaredNorm() - own.radius * own.radius;
    for (const std::uint32_t j : near_) {
      if (j == i) continue;
      const CoverSphere& other = balls_[j];
      const Vector3d across = 2 * (other.centre - own.centre);
      const double bound = other.centre.squaredNorm() - other.radius * other.radius - own_power;
      clipped_.clear();
      double before = across.dot(piece_.back()) - bound;
      for (std::size_t k = 0, last = piece_.size() - 1; k < piece_.size(); last = k++) {
        const double here = across.dot(piece_[k]) - bound;
        if ((before > 0) != (here > 0))
          clipped_.push_back(piece_[last] + before / (before - here) * (piece_[k] - piece_[last]));
        if (here <= 0) clipped_.push_back(piece_[k]);
        before = here;
      }
      const bool cut = clipped_.size() != piece_.size();
      piece_.swap(clipped_);
      if (piece_.empty() || (cut && holds(own, piece_))) return false;
    }
    return !holds(own, piece_);
  }

  void emit(const Vector3d& place, std::vector<OpenCorner>& out) const {
    double gap = std::numeric_limits<double>::infinity();
    for (const CoverSphere& ball : balls_)
      gap = std::min(gap, std::sqrt((place - ball.centre).squaredNorm()) - ball.radius);
    if (gap > 0) out.push_back({place, gap});
  }

  const std::span<const CoverSphere> balls_;
  std::vector<std::uint32_t> touching_, near_;  ///< balls that reach to the box, and to a triangle
  Polygon piece_, clipped_;
};

/// Places of the surface outside the balls, unit frame; none if it is covered up to rounding: this
/// is for a search, open_surface() proves. Other places may be further outside, between balls of
/// different radii a few times as far.
///
/// The balls' power diagram cuts each triangle into convex pieces; the points of a piece are
/// nearest, by power, to the ball of its cell. So the ball contains the piece if it contains its
/// corners, and if it does not contain a corner, no ball does.
///
/// `holders`: for each triangle a ball that may contain all of it, from an earlier call with balls
/// that have moved little, or empty; updated by this call.
std::vector<OpenCorner> open_corners(const MeshView& mesh, std::span<const CoverSphere> balls,
                                     std::vector<std::uint32_t>& holders) {
  holders.resize(mesh.triangle_count, UINT32_MAX);
  constexpr std::uint32_t kBlock = 32;  // triangles
  const std::uint32_t blocks = (mesh.triangle_count + kBlock - 1) / kBlock;
  std::vector<std::vector<OpenCorner>> found(blocks);
  tbb::parallel_for(std::uint32_t{0}, blocks, [&](std::uint32_t block) {
    const std::uint32_t end = std::min(mesh.triangle_count, (block + 1) * kBlock);
    Eigen::AlignedBox3d box;
    for (std::uint32_t t = block * kBlock; t < end; ++t)
      for (const Vector3d& corner : triangle_corners(mesh, t)) box.extend(corner);
    Cutter cutter(balls, box);
    for (std::uint32_t t = block * kBlock; t < end; ++t)
      cutter.cut(triangle_corners(mesh, t), holders[t], found[block]);
  });
  std::vector<OpenCorner> out;
  for (const auto& corners : found) out.insert(out.end(), corners.begin(), corners.end());
  return out;
}

/// A ball's centre, and the excess of the distance to its farthest point over that to its nearest
/// wall.
struct Recentred {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double excess = 0;
};

struct Look {
  double farthest = 0, nearest = 0;
  double excess() const { return farthest - nearest; }
};

Look look(const Vector3d& c, std::span<const Vector3d> points, std::span<const Vector3d> walls) {
  double far2 = 0, near2 = std::numeric_limits<double>::infinity();
  for (const Vector3d& p : points) far2 = std::max(far2, (p - c).squaredNorm());
  for (const Vector3d& w : walls) near2 = std::min(near2, (w - c).squaredNorm());
  return {std::sqrt(far2), walls.empty() ? 0 : std::sqrt(near2)};
}

/// Directions to the centre from the points that are nearly extreme.
struct Slopes {
  std::vector<Vector3d> up, down;

  void collect(const Vector3d& c, const Look& at, std::span<const Vector3d> points,
               std::span<const Vector3d> walls, double slack) {
    up.clear();
    down.clear();
    const double from = std::max(0.0, at.farthest - slack), to = at.nearest + slack;
    for (const Vector3d& p : points)
      if (const double d2 = (p - c).squaredNorm(); d2 >= from * from && d2 > 0)
        up.push_back((c - p) / std::sqrt(d2));
    for (const Vector3d& w : walls)
      if (const double d2 = (w - c).squaredNorm(); d2 <= to * to && d2 > 0)
        down.push_back((c - w) / std::sqrt(d2));
    if (up.empty()) up.push_back(Vector3d::Zero());
    if (down.empty()) down.push_back(Vector3d::Zero());
  }

  /// The shortest vector of hull(up) − hull(down), by Frank and Wolfe's steps.
  Vector3d shortest() const {
    Vector3d g = up.front() - down.front();
    for (int step = 0; step < 24; ++step) {
      const Vector3d* u = &up.front();
      const Vector3d* v = &down.front();
      double least = std::numeric_limits<double>::infinity(), most = -least;
      for (const Vector3d& one : up)
        if (const double x = g.dot(one); x < least) least = x, u = &one;
      for (const Vector3d& one : down)
        if (const double x = g.dot(one); x > most) most = x, v = &one;
      const Vector3d change = (*u - *v) - g;
      const double slope = -g.dot(change);
      if (slope <= 1e-3 * g.squaredNorm()) break;
      g += std::min(1.0, slope / change.squaredNorm()) * change;
    }
    return g;
  }
};

/// Moves a centre, by at most `trust`, to minimise the excess of the farthest of `points` over the
/// nearest of `walls`: steepest descent of max |p − c| − min |w − c|, along the shortest vector of
/// the hull of all nearly active slopes. `points` must not be empty; walls missing from the list
/// must be no nearer than any listed one, wherever the centre may move.
Recentred recentre(const Vector3d& start, std::span<const Vector3d> points,
                   std::span<const Vector3d> walls, double trust) {
  Vector3d c = start;
  Look at = look(c, points, walls);
  double slack = 0.3 * trust, step = 0.5 * trust;
  Slopes slopes;
  for (int round = 0; round < 14 && slack > 1e-3 * trust; ++round) {
    slopes.collect(c, at, points, walls, slack);
    const Vector3d g = slopes.shortest();
    const double slope = std::sqrt(g.squaredNorm());
    if (slope < 0.02) {
      slack *= 0.2;
      continue;
    }
    bool moved = false;
    for (double t = step; t > 0.02 * slack; t *= 0.4) {
      const Vector3d next = c - (t / slope) * g;
      if ((next - start).squaredNorm() > trust * trust) continue;
      const Look there = look(next, points, walls);
      if (there.excess() < at.excess() - 0.1 * t * slope) {
        c = next;
        at = there;
        step = std::min(2 * t, trust);
        moved = true;
        break;
      }
    }
    if (!moved) slack *= 0.3;
  }
  return {c, at.excess()};
}

constexpr double kFirstStep = 0.08;  ///< by which the level is lowered at a time
constexpr double kLastStep = 0.003;
constexpr double kHeld = 0.002;       ///< of the level: smaller gaps are ignored
constexpr double kBeyond = 1.005;     ///< of the level: balls that reach no further need no ray
constexpr double kWorthwhile = 0.01;  ///< by which a level must fall before rays are examined
constexpr int kPatience = 3;          ///< examinations of a level without gain
constexpr double kVouched = 0.9;      ///< of a level: results are not trusted below it
constexpr int kRoundsALook = 3;
constexpr double kApart = 0.05;  ///< levels between targets that one examination adds

/// A ball of radius 0 has its centre too far out, and stays empty.
std::vector<CoverSphere> grown(std::vector<CoverSphere> balls, double by) {
  for (CoverSphere& ball : balls)
    if (ball.radius > 0) ball.radius += by;
  return balls;
}

}  // namespace

/// The places of the balls, and how far each may move at a time.
struct CoverDescent::Balls {
  Balls(const OffsetSurface& surface, std::vector<Vector3d> at)
      : centres(std::move(at)), trust(centres.size(), 0.5 * surface.level()) {
    measure(surface);
  }

  void measure(const OffsetSurface& surface) {
    radii.clear();
    for (const Vector3d& c : centres) radii.push_back(surface.radius(c));
  }

  std::vector<CoverSphere> spheres() const {
    std::vector<CoverSphere> spheres;
    for (std::size_t i = 0; i < centres.size(); ++i) spheres.push_back({centres[i], radii[i]});
    return spheres;
  }

  std::vector<Vector3d> centres;
  std::vector<double> radii, trust;
};

class CoverDescent::Round {
 public:
  Round(const PointGrid& targets, const OffsetSurface& surface, Balls& balls)
      : targets_(targets),
        surface_(surface),
        reach_(kReach * surface.level()),
        balls_(balls),
        holders_(targets.size(), 0) {
    for (std::size_t i = 0; i < balls.centres.size(); ++i)
      targets_.within(balls_.centres[i], balls_.radii[i],
                      [&](std::uint32_t x, float) { ++holders_[x]; });
    for (std::uint32_t x = 0; x < targets_.size(); ++x)
      if (holders_[x] == 0) open_.push_back(x);
  }

  /// Returns true if a ball moved.
  bool move_all() {
    bool moved = false;
    for (std::size_t i = 0; i < balls_.centres.size(); ++i) moved |= may_help(i) && move(i);
    return moved;
  }

 private:
  /// True if an open target is within reach of the ball.
  bool may_help(std::size_t i) {
    std::erase_if(open_, [&](std::uint32_t x) { return holders_[x] != 0; });
    const double reach = balls_.radii[i] + reach_;
    return std::any_of(open_.begin(), open_.end(), [&](std::uint32_t x) {
      return (targets_.point(x) - balls_.centres[i]).squaredNorm() <= reach * reach;
    });
  }

  bool move(std::size_t i) {
    Vector3d& centre = balls_.centres[i];
    double& radius = balls_.radii[i];
    if (!(radius > 0)) return false;
    const auto within = static_cast<float>(radius);
    const float within2 = within * within;
    needed_.clear();
    targets_.within(centre, radius + reach_, [&](std::uint32_t x, float d2) {
      if (holders_[x] == (d2 <= within2 ? 1 : 0)) needed_.push_back(targets_.point(x));
    });
    double& trust = balls_.trust[i];
    walls_.clear();
    surface_.walls(centre, radius + 2 * trust, walls_);
    const Recentred moved = recentre(centre, needed_, walls_, trust);
    const double next = surface_.radius(moved.centre);
    const double moved_by = std::sqrt((moved.centre - centre).squaredNorm());
    trust = std::clamp(moved_by > 0 ? 2 * moved_by : 0.5 * trust, 0.02 * surface_.level(),
                       0.7 * surface_.level());
    if (!(next > 0) || !(moved_by > 0)) return false;
    targets_.within(centre, radius, [&](std::uint32_t x, float) {
      if (--holders_[x] == 0) open_.push_back(x);
    });
    centre = moved.centre;
    radius = next;
    targets_.within(centre, radius, [&](std::uint32_t x, float) { ++holders_[x]; });
    return true;
  }

  /// Levels beyond its surface up to which a ball considers targets. Further away, it would give up
  /// what it contains for a target that it cannot reach, and gaps would grow.
  static constexpr double kReach = 0.3;

  const PointGrid& targets_;
  const OffsetSurface& surface_;
  const double reach_;
  Balls& balls_;
  std::vector<int> holders_;  ///< balls that contain a target
  std::vector<std::uint32_t>
      open_;  ///< targets that no ball contained; some may be contained by now
  std::vector<Vector3d> needed_, walls_;
};

/// Returns the distance of the worst place found outside.
double CoverDescent::add_targets(const std::vector<CoverSphere>& balls, double level) {
  std::vector<OpenCorner> open = open_corners(solid_.arrays(), balls, holders_);
  if (sampled_.share)
    for (OpenCorner& corner : open) corner.gap /= sampled_.share(corner.place, Vector3d::Zero());
  std::stable_sort(open.begin(), open.end(),
                   [](const OpenCorner& a, const OpenCorner& b) { return a.gap > b.gap; });
  std::unordered_set<std::uint64_t> seen;
  for (const OpenCorner& corner : open) {
    if (corner.gap <= kHeld * level) break;
    if (seen.insert(cell_key(corner.place, kApart * level)).second)
      sampled_.targets.push_back(corner.place);
  }
  return open.empty() ? 0 : open.front().gap;
}

/// Returns the excess reach of the worst ball.
double CoverDescent::add_rays(const OffsetSurface& surface, const std::vector<CoverSphere>& balls) {
  const double level = surface.level();
  std::vector<std::vector<Vector3d>> beyond(balls.size());
  std::vector<double> further(balls.size(), 0);
  vouched_.resize(balls.size(), {Vector3d::Zero(), 0});
  tbb::parallel_for(std::size_t{0}, balls.size(), [&](std::size_t i) {
    // A place that was examined before is skipped.
    CoverSphere& vouched = vouched_[i];
    if (vouched.centre == balls[i].centre && level <= vouched.radius &&
        level > kVouched * vouched.radius)
      return;
    // So is one that the distance alone proves.
    if (balls[i].radius <= surface.sure_radius(balls[i].centre) * (1 + 1e-9)) return;
    further[i] =
        guessed_protrusion(solid_, balls[i], 0.05, kBeyond * level, beyond[i]).least - level;
    if (further[i] <= (kBeyond - 1) * level) {
      further[i] = 0;
      vouched = {balls[i].centre, level};
    }
  });
  std::unordered_set<std::uint64_t> seen;
  for (const auto& points : beyond) {
    for (const Vector3d& p : points) {
      if (!seen.insert(cell_key(p, 0.2 * level)).second) continue;
      const ClosestPoint foot = solid_.closest_point(p);
      const Vector3d out = (p - foot.point) / foot.distance;
      sampled_.rays.push_back(
          {foot.point, out, foot.distance, sampled_.share ? sampled_.share(foot.point, out) : 1});
    }
  }
  return std::max(0.0, *std::max_element(further.begin(), further.end()));
}

/// Returns the depth of the place found, 0 if none was.
double CoverDescent::add_void(const std::vector<CoverSphere>& balls, double level) {
  const OpenPlace open = open_void(solid_, balls);
  if (!open.found || open.gap <= kHeld * level) return 0;
  sampled_.targets.push_back(open.place);
  return open.gap;
}

LookedCover CoverDescent::improve(LevelCover start, int rounds, const std::function<void()>& look) {
  LookedCover looked = {std::move(start), {}};
  LevelCover& cover = looked.cover;
  // The level of the samples is not yet proven: the first round measures it.
  for (double step = 0; rounds > 0 && (step == 0 || step > kLastStep);) {
    const bool first = step == 0;
    const double aim = cover.level * (1 - step);
    // Uses the target level, not the level reached: rays that end between the two are walls here.
    OffsetSurface surface(solid_, sampled_, aim);
    Balls balls(surface, cover.centres);
    double best_here = std::numeric_limits<double>::infinity();
    bool gained = false;
    for (int idle = 0; idle < kPatience && rounds > 0;) {
      if (!first) {
        const PointGrid targets(sampled_.targets);
        Round round(targets, surface, balls);
        for (int k = 0; k < kRoundsALook; ++k, --rounds)
          if (!round.move_all()) break;
      }
      look();
      const std::vector<CoverSphere> spheres = balls.spheres();
      double level = aim + add_targets(spheres, aim);
      const auto grown_to = [&](double to) {
        return sampled_.share ? Balls({solid_, sampled_, to}, balls.centres).spheres()
                              : grown(spheres, to - aim);
      };
      const auto is_better = [&] {
        return first || level < (1 - kWorthwhile) * cover.level ||
               (level < cover.level && level <= aim * (1 + kHeld));
      };
      if (is_better()) {
        level += add_void(grown_to(level + kHeld * aim), aim);
        const std::size_t rays = sampled_.rays.size();
        if (is_better()) level = std::max(level, aim + add_rays(surface, spheres));
        if (is_better()) {
          cover = {balls.centres, level};
          looked.balls = grown_to(level);
          gained = true;
        }
        if (sampled_.rays.size() != rays) {
          surface = OffsetSurface(solid_, sampled_, aim);
          balls.measure(surface);
        }
      }
      if (first || level <= aim * (1 + kHeld)) break;
      if (level < best_here * (1 - 1e-3)) {
        best_here = level;
        idle = 0;
      } else {
        ++idle;
      }
    }
    if (first)
      step = kFirstStep;
    else if (!gained)
      step *= 0.5;
  }
  return looked;
}

}  // namespace ist
