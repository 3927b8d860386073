#include "robots/covers/offset_surface.h"

#include <tbb/parallel_for.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "mesh/geometry/closest_point.h"
#include "robots/covers/point_grid.h"

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
  // The excess distance of a point beside the nearest place.
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

PointGrid::PointGrid(std::span<const Eigen::Vector3d> points) {
  if (points.empty()) return;
  constexpr double kCells = 32;  // along the longest axis
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : points) box.extend(p);
  const double cell = std::max(box.sizes().maxCoeff() / kCells, 1e-9);
  cell_ = static_cast<float>(cell);
  per_cell_ = 1 / cell_;
  std::size_t cells = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<int>(k);
    low_[k] = static_cast<float>(box.min()[axis]);
    count_[k] = 1 + static_cast<int>((box.max()[axis] - box.min()[axis]) / cell);
    cells *= static_cast<std::size_t>(count_[k]);
  }
  const auto cell_of = [&](const Eigen::Vector3d& p) {
    std::size_t at = 0;
    for (std::size_t k = 3; k-- > 0;) {
      const float x = (static_cast<float>(p[static_cast<int>(k)]) - low_[k]) * per_cell_;
      const int i = std::clamp(static_cast<int>(x), 0, count_[k] - 1);
      at = at * static_cast<std::size_t>(count_[k]) + static_cast<std::size_t>(i);
    }
    return at;
  };
  in_cells_ = ItemGroups<>(cells, [&](const auto& visit) {
    for (std::uint32_t i = 0; i < points.size(); ++i) visit(cell_of(points[i]), i);
  });
  for (std::size_t k = 0; k < 3; ++k) {
    xyz_[k].assign(points.size() + kLanes, 1e30f);
    for (std::uint32_t place = 0; place < size(); ++place)
      xyz_[k][place] = static_cast<float>(points[index(place)][static_cast<int>(k)]);
  }
}

}  // namespace ist
