#include "robots/covers/cover_proof.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "robots/covers/triangles.h"

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr double kSmallCube = 1e-3;     ///< unit frame
constexpr double kSmallestCube = 1e-9;  ///< unit frame: smaller ones stay unproven
constexpr double kSmallBesideGap = 0.25;

using BallList = std::vector<std::uint32_t>;

double distance(const Vector3d& a, const Vector3d& b) { return std::sqrt((a - b).squaredNorm()); }

/// Calls `take(part)` for every open part until it returns false; meanwhile it may enlarge balls.
template <class Take>
class SurfaceSearch {
 public:
  SurfaceSearch(std::span<const CoverSphere> balls, double finest, const Take& take)
      : balls_(balls), finest_(finest), take_(take) {}

  void search(const std::array<Vector3d, 3>& t, const BallList& from, int depth = 0) {
    if (ended_) return;
    for (const std::uint32_t i : from)
      if (holds(balls_[i], t)) return;
    const Vector3d middle = (t[0] + t[1] + t[2]) / 3;
    double reach = 0;
    for (const Vector3d& corner : t) reach = std::max(reach, distance(corner, middle));
    double gap = std::numeric_limits<double>::infinity();
    OpenPart part{middle, 0, 0, 0};
    double least = std::numeric_limits<double>::infinity();
    for (const std::uint32_t i : from) {
      const CoverSphere& ball = balls_[i];
      double farthest = 0;
      for (const Vector3d& corner : t) farthest = std::max(farthest, distance(corner, ball.centre));
      const double lacks = farthest + kDistanceMargin - ball.radius;
      gap = std::min(gap, distance(middle, ball.centre) - ball.radius);
      if (lacks < least) {
        least = lacks;
        part.ball = i;
        part.radius = farthest + 4 * kDistanceMargin;
      }
    }
    part.gap = std::max(0.0, gap);
    // No ball would need less growth for a smaller part, up to `finest`.
    if (least - part.gap <= finest_ || reach <= kSmallBesideGap * gap || depth >= kDeepest) {
      ended_ = !take_(part);
      return;
    }
    BallList list;
    for (const std::uint32_t i : from)
      if (distance(middle, balls_[i].centre) - balls_[i].radius <=
          gap + 2 * reach + kDistanceMargin)
        list.push_back(i);
    for (const HalvableTriangle& half : halves(t, longest_side(t).from))
      search(half, list, depth + 1);
  }

 private:
  static bool holds(const CoverSphere& ball, const std::array<Vector3d, 3>& t) {
    const double within = ball.radius - 2 * kDistanceMargin;
    if (!(within > 0)) return false;
    for (const Vector3d& corner : t)
      if ((corner - ball.centre).squaredNorm() > within * within) return false;
    return true;
  }

  static constexpr int kDeepest = 120;
  std::span<const CoverSphere> balls_;
  const double finest_;
  const Take& take_;
  bool ended_ = false;
};

class VoidSearch {
 public:
  VoidSearch(const MeshSolid& solid, std::span<const CoverSphere> balls)
      : solid_(solid), balls_(balls) {}

  struct Cube {
    Vector3d middle;
    double half;
  };

  /// The cube is settled, or must be divided: then `kept` contains the balls that reach into it.
  enum class Verdict { settled, divide, open };
  Verdict look(const Cube& cube, const BallList& from, BallList& kept, OpenPlace& open) const {
    double gap = std::numeric_limits<double>::infinity();
    int crossing = 0;
    kept.clear();
    for (const std::uint32_t i : from) {
      const CoverSphere& ball = balls_[i];
      const Eigen::Array3d d = (cube.middle - ball.centre).array().abs();
      const double farthest = std::sqrt((d + cube.half).matrix().squaredNorm());
      if (farthest + kDistanceMargin <= ball.radius) return Verdict::settled;
      const double nearest = std::sqrt((d - cube.half).max(0.0).matrix().squaredNorm());
      if (nearest > ball.radius + kDistanceMargin) continue;
      gap = std::min(gap, std::sqrt(d.matrix().squaredNorm()) - ball.radius);
      ++crossing;
      kept.push_back(i);
    }
    if (crossing < 3 || may_rise(cube, kept)) return Verdict::settled;
    // If balls nearly coincide, only this ends the division.
    if (gap > 0 || cube.half < kSmallCube) {
      const double corner = 1.7320508075688774 * cube.half + kDistanceMargin;
      if (!solid_.inside(cube.middle)) {
        if (solid_.closest_point(cube.middle, corner).triangle == kNoTriangle)
          return Verdict::settled;
      } else if (gap > 0 &&
                 solid_.closest_point(cube.middle, kDistanceMargin).triangle == kNoTriangle &&
                 gap > kDistanceMargin) {
        open = {true, cube.middle, gap};
        return Verdict::open;
      }
    }
    if (cube.half < kSmallestCube) {
      open = {true, cube.middle, 0};
      return Verdict::open;
    }
    return Verdict::divide;
  }

  OpenPlace search(const Cube& cube, const BallList& from) const {
    BallList kept;
    OpenPlace open;
    if (look(cube, from, kept, open) != Verdict::divide) return open;
    for (int k = 0; k < 8 && !open.found; ++k) open = search(part(cube, k), kept);
    return open;
  }

  static Cube part(const Cube& cube, int k) {
    return {middle_of_part(cube.middle, cube.half, k), cube.half / 2};
  }

 private:
  /// True if every point of the cube that is on spheres can move a little out of all of them and
  /// up, so that none is the highest of a void.
  bool may_rise(const Cube& cube, const BallList& crossing) const {
    const Vector3d up(0.36, 0.48, 0.8);
    Vector3d out = Vector3d::Zero();
    for (const std::uint32_t i : crossing) {
      const Vector3d d = cube.middle - balls_[i].centre;
      out += d / std::max(std::sqrt(d.squaredNorm()), kDistanceMargin);
    }
    Vector3d climb = out - out.dot(up) * up;
    climb += 1e-3 * std::sqrt(climb.squaredNorm()) * up;
    const double slack = cube.half * climb.cwiseAbs().sum() + kDistanceMargin;
    return climb.dot(up) > 0 && std::all_of(crossing.begin(), crossing.end(), [&](std::uint32_t i) {
             return climb.dot(cube.middle - balls_[i].centre) > slack;
           });
  }

  const MeshSolid& solid_;
  std::span<const CoverSphere> balls_;
};

BallList all_of(std::size_t count) {
  BallList all(count);
  std::iota(all.begin(), all.end(), 0u);
  return all;
}

/// The balls that no other ball contains: the union is the same without the others, and coincident
/// spheres would cross everywhere.
BallList outermost(std::span<const CoverSphere> balls) {
  BallList list;
  for (std::uint32_t i = 0; i < balls.size(); ++i) {
    const auto is_held = [&](std::uint32_t by) {
      const double reach = distance(balls[i].centre, balls[by].centre) + balls[i].radius;
      const bool same = balls[i].centre == balls[by].centre && balls[i].radius == balls[by].radius;
      return same ? by < i : by != i && reach + kDistanceMargin <= balls[by].radius;
    };
    bool held = false;
    for (std::uint32_t by = 0; by < balls.size() && !held; ++by) held = is_held(by);
    if (!held) list.push_back(i);
  }
  return list;
}

}  // namespace

std::vector<OpenPart> open_surface(const MeshView& mesh, std::span<const CoverSphere> balls,
                                   double finest, std::size_t most) {
  const BallList all = all_of(balls.size());
  std::vector<std::vector<OpenPart>> found(mesh.triangle_count);
  tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count, [&](std::uint32_t t) {
    const auto take = [&](const OpenPart& part) {
      found[t].push_back(part);
      return found[t].size() < most;
    };
    SurfaceSearch(balls, finest, take).search(triangle_corners(mesh, t), all);
  });
  std::vector<OpenPart> out;
  for (const auto& parts : found) out.insert(out.end(), parts.begin(), parts.end());
  return out;
}

OpenPlace open_void(const MeshSolid& solid, std::span<const CoverSphere> balls) {
  const VoidSearch search(solid, balls);
  // Four levels at once, then one task per cube.
  std::vector<std::pair<VoidSearch::Cube, BallList>> cubes = {
      {{Vector3d::Zero(), 1.0 + 1e-9}, outermost(balls)}};
  for (int level = 0; level < 4; ++level) {
    std::vector<std::pair<VoidSearch::Cube, BallList>> next;
    BallList kept;
    for (const auto& [cube, list] : cubes) {
      OpenPlace open;
      const VoidSearch::Verdict verdict = search.look(cube, list, kept, open);
      if (verdict == VoidSearch::Verdict::open) return open;
      if (verdict == VoidSearch::Verdict::settled) continue;
      for (int k = 0; k < 8; ++k) next.emplace_back(VoidSearch::part(cube, k), kept);
    }
    cubes = std::move(next);
  }
  std::vector<OpenPlace> found(cubes.size());
  tbb::parallel_for(std::size_t{0}, cubes.size(), [&](std::size_t i) {
    found[i] = search.search(cubes[i].first, cubes[i].second);
  });
  for (const OpenPlace& open : found)
    if (open.found) return open;
  return {};
}

void grow_to_cover(const MeshSolid& solid, std::vector<CoverSphere>& balls, double finest) {
  // A ball that was enlarged for one part often contains the next.
  const auto take = [&](const OpenPart& part) {
    double& radius = balls[part.ball].radius;
    radius = std::max(radius, part.radius);
    return true;
  };
  const BallList all = all_of(balls.size());
  for (std::uint32_t t = 0; t < solid.view().triangle_count; ++t)
    SurfaceSearch(balls, finest, take).search(triangle_corners(solid.view(), t), all);
  for (int round = 0; round < 50; ++round) {
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

}  // namespace ist
