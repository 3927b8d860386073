#include "robots/covers/offset_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "mesh/geometry/closest_point.h"

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr double kLargest = 4;  ///< unit frame, of a ball

}  // namespace

double depth_in(const MeshSolid& solid, const Vector3d& point) {
  const float p[3] = {static_cast<float>(point.x()), static_cast<float>(point.y()),
                      static_cast<float>(point.z())};
  const double distance = std::sqrt(double{nearest_triangle(solid.view(), p).distance2});
  return solid.inside(point) ? distance : -distance;
}

OffsetSurface::OffsetSurface(const MeshSolid& solid, const SampledSolid& sampled, double level)
    : solid_(&solid),
      level_(std::min(level, sampled.most)),
      spacing_(sampled.spacing),
      least_(level_) {
  std::vector<Vector3d> points, normals, tight;
  Eigen::AlignedBox3d box;
  for (const OutwardRay& ray : sampled.rays) {
    const double here = std::min(level * ray.share, level_);
    if (ray.reach < here) continue;
    points.push_back(ray.foot + here * ray.direction);
    if (ray.share < 1) tight.push_back(points.back());
    least_ = std::min(least_, here);
    normals.push_back(ray.direction);
    box.extend(points.back());
  }
  largest_ = points.empty() ? kLargest : std::min(kLargest, 0.51 * box.sizes().minCoeff() + 1e-3);
  points_ = PointGrid(points);
  tight_ = PointGrid(tight);
  for (std::uint32_t i = 0; i < points_.size(); ++i) normals_.push_back(normals[points_.index(i)]);
}

double OffsetSurface::radius(const Vector3d& centre, double depth) const {
  // By so much a point beside the nearest place is further than that.
  const auto coarse = [&](double seen) { return spacing_ * spacing_ / (2 * seen); };
  const auto kept = [&](double radius) {
    const PointGrid::Nearest near = tight_.nearest(centre, radius, radius);
    if (near.place == UINT32_MAX) return radius;
    const double seen = std::sqrt(double{near.distance2});
    return std::min(radius, std::max({0.0, least_ + depth, seen - coarse(seen)}));
  };
  const double sure = std::max(0.0, level_ + depth);
  const PointGrid::Nearest near = points_.nearest(centre, sure + 0.2 * level_, kLargest);
  if (near.place == UINT32_MAX) return kept(std::max(sure, kLargest));
  if ((points_.point(near.place) - centre).dot(normals_[near.place]) < 0) return kept(sure);
  const double seen = std::sqrt(double{near.distance2});
  return kept(std::max(sure, seen - coarse(seen)));
}

double OffsetSurface::sure_radius(const Vector3d& centre) const {
  return std::max(0.0, level_ + depth_in(*solid_, centre));
}

void OffsetSurface::walls(const Vector3d& centre, double reach, std::vector<Vector3d>& out) const {
  points_.within(centre, reach, [&](std::uint32_t i, float) { out.push_back(points_.point(i)); });
}

std::vector<Vector3d> OffsetSurface::medial_centres(std::size_t most) const {
  const std::size_t stride =
      std::max<std::size_t>(1, points_.size() / std::max<std::size_t>(most, 1));
  const std::size_t count = points_.size() / stride;
  std::vector<Vector3d> centres(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    const auto j = static_cast<std::uint32_t>(i * stride);
    const Vector3d y = points_.point(j);
    double r = largest_;
    // A ball that touches y from inside shrinks until no point is in it.
    for (int step = 0; step < 30; ++step) {
      const Vector3d c = y - r * normals_[j];
      const PointGrid::Nearest near = points_.nearest(c, r * (1 - 1e-6), r * (1 - 1e-6));
      if (near.place == UINT32_MAX) break;
      const Vector3d d = y - points_.point(near.place);
      const double along = d.dot(normals_[j]);
      if (!(along > 0)) break;
      const double smaller = d.squaredNorm() / (2 * along);
      if (!(smaller < r * (1 - 1e-5))) break;
      r = smaller;
    }
    centres[i] = y - r * normals_[j];
  });
  return centres;
}

}  // namespace ist
