#include "query/impact/impact_side.h"

#include <algorithm>
#include <bit>

#include "query/probe/membership.h"
#include "query/probe/surface_distance.h"

namespace ist {
namespace {

using Eigen::Vector3d;

// A little further, for the rounding of what is compared.
constexpr double kMore = 1 + 1e-12;

class PartSearch {
 public:
  PartSearch(const SurfaceTree& a, const ImpactSide& b, const Similarity& a_from_b) noexcept
      : a_(a), b_(b), map_(a_from_b) {}

  bool open(int level, std::uint32_t number) const noexcept {
    const NodeBall ball = b_.ball(level, number);
    double at[3];
    map_.apply(ball.centre, at);
    const double reach = kMore * (map_.scale * ball.r + a_.header->error);
    if (!(nearest_surface(a_, at, reach).distance < reach)) return inside_surface(a_, at, reach);
    if (level == 0 && b_.surface() != nullptr) return holds_part_of(b_.surface()->blocks[number]);
    if (level == kSphereLevel) return holds(b_.piece(number).corner[0]);
    const std::uint32_t count = b_.children(level, number);
    for (std::uint32_t i = 0; i < count; ++i)
      if (open(level - 1, kWidth * number + i)) return true;
    return false;
  }

 private:
  bool holds(const Vector3d& x) const noexcept {
    const double from[3] = {x.x(), x.y(), x.z()};
    double at[3];
    map_.apply(from, at);
    return inside_surface(a_, at, 0);
  }

  /// What hangs together and meets no surface lies on one side of it: a corner of each is asked.
  bool holds_part_of(const SurfaceBlock& block) const noexcept {
    std::uint32_t left = (1u << block.vertices) - 1;
    while (left != 0) {
      std::uint32_t part = left & (0 - left), before = 0;
      const auto first = static_cast<std::uint32_t>(std::countr_zero(left));
      while (part != before) {
        before = part;
        for (std::uint32_t t = 0; t < block.triangles; ++t) {
          const std::uint32_t corners =
              1u << block.corner[0][t] | 1u << block.corner[1][t] | 1u << block.corner[2][t];
          if ((part & corners) != 0) part |= corners;
        }
      }
      left &= ~part;
      if (holds({static_cast<double>(block.x[first]), static_cast<double>(block.y[first]),
                 static_cast<double>(block.z[first])}))
        return true;
    }
    return false;
  }

  const SurfaceTree& a_;
  const ImpactSide& b_;
  const Similarity& map_;
};

}  // namespace

ImpactSide::ImpactSide(const TreeView& view) noexcept
    : spheres_(sphere_tree(view, Measure::inner)) {
  if (!view.has_surface()) return;
  surface_.emplace(surface_tree(view));
  error_ = surface_->header->error;
}

std::uint32_t ImpactSide::children(int level, std::uint32_t number) const noexcept {
  if (surface_ && level == 0) return surface_->blocks[number].triangles;
  const std::uint32_t below =
      surface_ ? surface_->level[level - 1].count : spheres_.count(level - 1);
  return std::min(kWidth, below - kWidth * number);
}

NodeBall ImpactSide::ball(int level, std::uint32_t number) const noexcept {
  if (level == top()) {
    const TreeHeader& tree = *spheres_.header;
    const double reach = std::max(tree.root[3], tree.root_cover);
    return {{tree.root[0], tree.root[1], tree.root[2]}, reach + 2 * error_};
  }
  if (!surface_) {
    NodeBall ball = spheres_.ball(level, number);
    ball.r = level == kSphereLevel ? static_cast<double>(spheres_.sphere_cover[number])
                                   : spheres_.cover(level, number);
    return ball;
  }
  if (level == kSphereLevel) {
    const ConvexPiece triangle = piece(number);
    const Vector3d* const c = triangle.corner;
    const Vector3d middle = (c[0] + c[1] + c[2]) / 3;
    double r2 = 0;
    for (int k = 0; k < 3; ++k) r2 = std::max(r2, (c[k] - middle).squaredNorm());
    return {{middle.x(), middle.y(), middle.z()}, kMore * std::sqrt(r2) + error_};
  }
  const SurfaceTree::Level& above = surface_->level[level + 1];
  NodeBall ball =
      lane_ball(above.balls[number / kWidth], above.origins[number / kWidth], number % kWidth);
  ball.r += error_;
  return ball;
}

PointHull ImpactSide::hull(int level, std::uint32_t number) const noexcept {
  PointHull hull;
  if (level == kSphereLevel) {
    const ConvexPiece one = piece(number);
    hull.count = static_cast<std::uint32_t>(one.corners);
    for (int k = 0; k < one.corners; ++k) {
      hull.x[k] = one.corner[k].x();
      hull.y[k] = one.corner[k].y();
      hull.z[k] = one.corner[k].z();
    }
    return hull;
  }
  if (!has_hull(level)) {
    const NodeBall around = ball(level, number);
    hull.count = 1;
    hull.x[0] = around.centre[0];
    hull.y[0] = around.centre[1];
    hull.z[0] = around.centre[2];
    return hull;
  }
  const SurfaceBlock& block = surface_->blocks[number];
  hull.count = block.vertices;
  for (std::uint32_t k = 0; k < block.vertices; ++k) {
    hull.x[k] = static_cast<double>(block.x[k]);
    hull.y[k] = static_cast<double>(block.y[k]);
    hull.z[k] = static_cast<double>(block.z[k]);
  }
  return hull;
}

double ImpactSide::beyond(int level, std::uint32_t number) const noexcept {
  if (!has_hull(level)) return ball(level, number).r;
  return surface_ ? error_ : static_cast<double>(spheres_.sphere_cover[number]);
}

ConvexPiece ImpactSide::piece(std::uint32_t number) const noexcept {
  ConvexPiece piece;
  if (!surface_) {
    const NodeBall sphere = spheres_.sphere(number / kWidth, number % kWidth);
    piece.corner[0] = vector(sphere.centre);
    piece.beyond = static_cast<double>(spheres_.sphere_cover[number]);
    piece.behind = -sphere.r;
    return piece;
  }
  piece.corners = 3;
  for (int k = 0; k < 3; ++k) {
    float x[3];
    surface_->corner(number / kWidth, number % kWidth, k, x);
    for (int i = 0; i < 3; ++i) piece.corner[k][i] = static_cast<double>(x[i]);
  }
  piece.beyond = piece.behind = error_;
  return piece;
}

bool holds_part(const SurfaceTree& a, const ImpactSide& b, const Similarity& a_from_b) noexcept {
  return PartSearch(a, b, a_from_b).open(b.top(), 0);
}

}  // namespace ist
