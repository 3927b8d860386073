#include "spheres/offset_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr double kLargest = 4;  ///< unit frame, of a ball

}  // namespace

OffsetSurface::OffsetSurface(const MeshSolid& solid, const SampledSolid& sampled, double level)
    : solid_(solid), level_(level), spacing_(sampled.spacing) {
  for (const OutwardRay& ray : sampled.rays) {
    if (ray.reach < level) continue;
    points_.push_back(ray.foot + level * ray.direction);
    normals_.push_back(ray.direction);
  }
  tree_ = PointTree(points_);
}

double OffsetSurface::radius(const Vector3d& centre) const {
  const PointTree::Nearest near = tree_.nearest(centre);
  const double seen = near.index == UINT32_MAX ? kLargest : std::sqrt(near.distance2);
  if (near.index != UINT32_MAX && (points_[near.index] - centre).dot(normals_[near.index]) < 0)
    return 0;
  const double sure = sure_radius(centre);
  // By so much a point beside the nearest place is further than that.
  const double coarse = spacing_ * spacing_ / (2 * seen);
  return std::max(sure, seen - coarse);
}

double OffsetSurface::sure_radius(const Vector3d& centre) const {
  const double depth = solid_.closest_point(centre).distance;
  if (solid_.inside(centre)) return level_ + depth;
  return std::max(0.0, level_ - depth);
}

void OffsetSurface::walls(const Vector3d& centre, double reach, std::vector<Vector3d>& out) const {
  tree_.within(centre, reach, [&](std::uint32_t i, double) { out.push_back(points_[i]); });
}

std::vector<Vector3d> OffsetSurface::medial_centres(std::size_t most) const {
  const std::size_t stride =
      std::max<std::size_t>(1, points_.size() / std::max<std::size_t>(most, 1));
  const std::size_t count = points_.size() / stride;
  std::vector<Vector3d> centres(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    const std::size_t j = i * stride;
    const Vector3d& y = points_[j];
    double r = kLargest;
    // A ball that touches y from inside shrinks until no point is in it.
    for (int step = 0; step < 30; ++step) {
      const Vector3d c = y - r * normals_[j];
      const PointTree::Nearest near = tree_.nearest(c, r * r * (1 - 1e-9));
      if (near.index == UINT32_MAX) break;
      const Vector3d d = y - points_[near.index];
      const double along = d.dot(normals_[j]);
      if (!(along > 0)) break;
      const double smaller = d.squaredNorm() / (2 * along);
      if (!(smaller < r * (1 - 1e-9))) break;
      r = smaller;
    }
    centres[i] = y - r * normals_[j];
  });
  return centres;
}

}  // namespace ist
