#include "spheres/cover_proof.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr double kMargin = 1e-12;      ///< unit frame, above the rounding of any distance here
constexpr double kSmallestCube = 1e-9;  ///< unit frame: smaller ones stay unproven
constexpr double kSmallBesideGap = 0.25;

using BallList = std::vector<std::uint32_t>;

double distance(const Vector3d& a, const Vector3d& b) { return std::sqrt((a - b).squaredNorm()); }

class SurfaceSearch {
 public:
  SurfaceSearch(std::span<const CoverSphere> balls, double finest)
      : balls_(balls), finest_(finest) {}

  void search(const std::array<Vector3d, 3>& t, const BallList& from, int depth,
              std::vector<OpenPart>& out) {
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
      const double lacks = farthest + kMargin - ball.radius;
      if (lacks <= 0) return;  // held whole
      gap = std::min(gap, distance(middle, ball.centre) - ball.radius);
      if (lacks < least) {
        least = lacks;
        part.ball = i;
        part.radius = farthest + 2 * kMargin;
      }
    }
    part.gap = std::max(0.0, gap);
    if (reach <= finest_ || reach <= kSmallBesideGap * gap || depth >= kDeepest) {
      out.push_back(part);
      return;
    }
    BallList list;
    for (const std::uint32_t i : from)
      if (distance(middle, balls_[i].centre) - balls_[i].radius <= gap + 2 * reach + kMargin)
        list.push_back(i);
    std::size_t side = 0;
    double longest2 = -1;
    for (std::size_t k = 0; k < 3; ++k) {
      const double d2 = (t[(k + 1) % 3] - t[k]).squaredNorm();
      if (d2 > longest2) {
        longest2 = d2;
        side = k;
      }
    }
    const Vector3d &a = t[side], &b = t[(side + 1) % 3], &c = t[(side + 2) % 3];
    const Vector3d half = (a + b) / 2;
    search({half, c, a}, list, depth + 1, out);
    search({b, c, half}, list, depth + 1, out);
  }

 private:
  static constexpr int kDeepest = 120;
  std::span<const CoverSphere> balls_;
  const double finest_;
};

class VoidSearch {
 public:
  VoidSearch(const MeshSolid& solid, std::span<const CoverSphere> balls)
      : solid_(solid), balls_(balls) {}

  struct Cube {
    Vector3d middle;
    double half;
  };

  /// The cube is settled, or is to be divided: then `kept` holds the balls that reach into it.
  enum class Verdict { settled, divide, open };
  Verdict look(const Cube& cube, const BallList& from, BallList& kept, OpenPlace& open) const {
    double gap = std::numeric_limits<double>::infinity();
    int crossing = 0;
    kept.clear();
    for (const std::uint32_t i : from) {
      const CoverSphere& ball = balls_[i];
      const Eigen::Array3d d = (cube.middle - ball.centre).array().abs();
      const double farthest = std::sqrt((d + cube.half).matrix().squaredNorm());
      if (farthest + kMargin <= ball.radius) return Verdict::settled;
      const double nearest = std::sqrt((d - cube.half).max(0.0).matrix().squaredNorm());
      if (nearest > ball.radius + kMargin) continue;
      gap = std::min(gap, std::sqrt(d.matrix().squaredNorm()) - ball.radius);
      ++crossing;
      kept.push_back(i);
    }
    if (crossing < 3) return Verdict::settled;
    if (gap > 0) {
      const double corner = 1.7320508075688774 * cube.half + kMargin;
      if (!solid_.inside(cube.middle)) {
        if (solid_.closest_point(cube.middle, corner).triangle == kNoTriangle)
          return Verdict::settled;
      } else if (solid_.closest_point(cube.middle, kMargin).triangle == kNoTriangle &&
                 gap > kMargin) {
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
    const double h = cube.half / 2;
    return {cube.middle + Vector3d((k & 1) != 0 ? h : -h, (k & 2) != 0 ? h : -h,
                                   (k & 4) != 0 ? h : -h),
            h};
  }

 private:
  const MeshSolid& solid_;
  std::span<const CoverSphere> balls_;
};

BallList all_of(std::size_t count) {
  BallList all(count);
  std::iota(all.begin(), all.end(), 0u);
  return all;
}

}  // namespace

std::vector<OpenPart> open_surface(const MeshView& mesh, std::span<const CoverSphere> balls,
                                   double finest) {
  const BallList all = all_of(balls.size());
  std::vector<std::vector<OpenPart>> found(mesh.triangle_count);
  tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count, [&](std::uint32_t t) {
    std::array<Vector3d, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const double* const v = mesh.vertices + 3 * std::size_t{mesh.triangles[3 * std::size_t{t} + k]};
      corners[k] = {v[0], v[1], v[2]};
    }
    SurfaceSearch(balls, finest).search(corners, all, 0, found[t]);
  });
  std::vector<OpenPart> out;
  for (const auto& parts : found) out.insert(out.end(), parts.begin(), parts.end());
  return out;
}

OpenPlace open_void(const MeshSolid& solid, std::span<const CoverSphere> balls) {
  const VoidSearch search(solid, balls);
  // Four levels at once, then a task a cube.
  std::vector<std::pair<VoidSearch::Cube, BallList>> cubes = {
      {{Vector3d::Zero(), 1.0 + 1e-9}, all_of(balls.size())}};
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

}  // namespace ist
