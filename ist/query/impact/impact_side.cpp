#include "query/impact/impact_side.h"

#include <algorithm>
#include <cmath>

#include "query/exact/mesh_queries.h"

namespace ist {
namespace {

using Eigen::Vector3d;

// Covers the rounding of comparisons.
constexpr double kMore = 1 + 1e-12;

/// True if A's mesh contains the centre of a sphere of B, which has no mesh.
bool contains_sphere(const MeshTree& a, const ImpactSide& b, const Similarity& a_from_b, int level,
                     std::uint32_t number) noexcept {
  const NodeBall ball = b.ball(level, number);
  const exact::Point at = map_point(a_from_b, {ball.centre[0], ball.centre[1], ball.centre[2]});
  const double reach = kMore * (a_from_b.scale * ball.r + a.header->error);
  if (level == kSphereLevel || !(nearest_on(a, at, reach).squared < reach * reach))
    return is_inside({a}, at);
  const std::uint32_t count = b.children(level, number);
  for (std::uint32_t i = 0; i < count; ++i)
    if (contains_sphere(a, b, a_from_b, level - 1, kWidth * number + i)) return true;
  return false;
}

}  // namespace

RootBall root_ball(const AssetHeader& asset) noexcept {
  if (asset.sphere_count != 0)
    return RootBall::of(asset.inner_tree.root, asset.inner_tree.root_cover);
  RootBall ball{};
  for (int k = 0; k < 3; ++k)
    ball.centre[k] = std::ldexp(asset.ball_centre[k] - asset.centre[k], -asset.exponent);
  ball.r = kMore * std::ldexp(asset.ball_radius, -asset.exponent);
  return ball;
}

ImpactSide::ImpactSide(const AssetView& view) noexcept
    : spheres_(sphere_tree(view, Measure::inner)), root_(root_ball(view.header())) {
  if (!view.has_mesh()) return;
  const AssetHeader& asset = view.header();
  mesh_.emplace(asset, *at<MeshHeader>(asset, asset.mesh));
  error_ = mesh_->header->error + mesh_->header->rounding;
}

std::uint32_t ImpactSide::children(int level, std::uint32_t number) const noexcept {
  if (mesh_ && level == 0) return mesh_->blocks[number].triangles;
  const std::uint32_t below = mesh_ ? mesh_->level[level - 1].count : spheres_.count(level - 1);
  return std::min(kWidth, below - kWidth * number);
}

NodeBall ImpactSide::ball(int level, std::uint32_t number) const noexcept {
  if (level == top())
    return {{root_.centre[0], root_.centre[1], root_.centre[2]}, root_.reach() + 2 * error_};
  if (!mesh_) {
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
  const BoxBlock& boxes = mesh_->level[level + 1].boxes[number / kWidth];
  const std::uint32_t lane = number % kWidth;
  NodeBall ball;
  double r2 = 0;
  for (int k = 0; k < 3; ++k) {
    const double low = boxes.low[k][lane], high = boxes.high[k][lane];
    ball.centre[k] = (low + high) / 2;
    r2 += (high - low) * (high - low) / 4;
  }
  ball.r = kMore * std::sqrt(r2) + error_;
  return ball;
}

PointHull ImpactSide::hull(int level, std::uint32_t number) const noexcept {
  PointHull hull;
  const auto add = [&](double x, double y, double z) {
    hull.x[hull.count] = x, hull.y[hull.count] = y, hull.z[hull.count++] = z;
  };
  if (level == kSphereLevel) {
    const ConvexPiece one = piece(number);
    for (int k = 0; k < one.corners; ++k)
      add(one.corner[k].x(), one.corner[k].y(), one.corner[k].z());
  } else if (!has_hull(level)) {
    const NodeBall around = ball(level, number);
    add(around.centre[0], around.centre[1], around.centre[2]);
  } else {
    const MeshBlock& block = mesh_->blocks[number];
    for (std::uint32_t k = 0; k < block.vertices; ++k) {
      const exact::Point x = mesh_->vertex(block.vertex[k]);
      add(x.x, x.y, x.z);
    }
  }
  return hull;
}

double ImpactSide::beyond(int level, std::uint32_t number) const noexcept {
  if (!has_hull(level)) return ball(level, number).r;
  return mesh_ ? error_ : static_cast<double>(spheres_.sphere_cover[number]);
}

ConvexPiece ImpactSide::piece(std::uint32_t number) const noexcept {
  ConvexPiece piece;
  if (!mesh_) {
    const NodeBall sphere = spheres_.sphere(number / kWidth, number % kWidth);
    piece.corner[0] = vector(sphere.centre);
    piece.beyond = static_cast<double>(spheres_.sphere_cover[number]);
    piece.behind = -sphere.r;
    return piece;
  }
  piece.corners = 3;
  const MeshBlock& block = mesh_->blocks[number / kWidth];
  for (int k = 0; k < 3; ++k)
    piece.corner[k] = vector(mesh_->vertex(block.vertex[block.corner[k][number % kWidth]]));
  piece.beyond = piece.behind = error_;
  return piece;
}

bool contains_part(const MeshTree& a, const ImpactSide& b, const Similarity& a_from_b) noexcept {
  if (b.mesh() == nullptr) return contains_sphere(a, b, a_from_b, b.top(), 0);
  // A shell that does not cross A lies on one side of it.
  const MeshTree& mesh = *b.mesh();
  return std::any_of(mesh.shells, mesh.shells + mesh.header->shell_count,
                     [&](const MeshShell& shell) {
                       const exact::Point x = mesh.vertex(mesh.blocks[shell.block].vertex[0]);
                       return is_inside({a}, map_point(a_from_b, x));
                     });
}

}  // namespace ist
