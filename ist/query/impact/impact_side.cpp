#include "query/impact/impact_side.h"

#include <algorithm>

#include "query/probe/membership.h"
#include "query/probe/surface_distance.h"

namespace ist {
namespace {

using Eigen::Vector3d;

Vector3d vector(const double (&x)[3]) noexcept { return {x[0], x[1], x[2]}; }

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
    if (level == kSphereLevel) {
      const ConvexPiece piece = b_.piece(number);
      const double corner[3] = {piece.corner[0].x(), piece.corner[0].y(), piece.corner[0].z()};
      map_.apply(corner, at);
      return inside_surface(a_, at, 0);
    }
    const std::uint32_t count = b_.children(level, number);
    for (std::uint32_t i = 0; i < count; ++i)
      if (open(level - 1, kWidth * number + i)) return true;
    return false;
  }

 private:
  const SurfaceTree& a_;
  const ImpactSide& b_;
  const Similarity& map_;
};

}  // namespace

ImpactSide::ImpactSide(const TreeView& view) noexcept
    : spheres_(sphere_tree(view, Measure::inner)) {
  if (!view.has_field()) return;
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
  const BallBlock& balls = above.balls[number / kWidth];
  const Origin& o = above.origins[number / kWidth];
  const std::uint32_t lane = number % kWidth;
  return {{o.x + static_cast<double>(balls.x[lane]), o.y + static_cast<double>(balls.y[lane]),
           o.z + static_cast<double>(balls.z[lane])},
          static_cast<double>(balls.r[lane]) + error_};
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
