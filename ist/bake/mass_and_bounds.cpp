#include "bake/mass_and_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "bake/cluster/bounding_ball.h"

namespace ist {
namespace {

using Eigen::Vector3d;

std::vector<Ball> vertices_of(const MeshView& mesh) {
  std::vector<Ball> points(mesh.vertex_count);
  for (std::size_t v = 0; v < points.size(); ++v) {
    const double* p = mesh.vertices + 3 * v;
    points[v] = {p[0], p[1], p[2], 0};
  }
  return points;
}

}  // namespace

void describe_mass(const MeshMoments& moments, AssetHeader& header) {
  header.volume = moments.volume;
  header.volume_error = moments.volume_error;
  for (int k = 0; k < 3; ++k) {
    header.centre_of_mass[k] = moments.centre[k];
    header.inertia[k] = moments.inertia(k, k);
    header.inertia[3 + k] = k < 2 ? moments.inertia(0, 1 + k) : moments.inertia(1, 2);
  }
  header.centre_of_mass_error = moments.centre_error;
  header.inertia_error = moments.inertia_error;
}

void describe_bounds(const MeshSolid& solid, double beyond, AssetHeader& header) {
  const UnitFrame& frame = solid.frame();
  const std::vector<Ball> points = vertices_of(solid.arrays());
  const Ball smallest = bounding_ball(points);
  Vector3d centre = frame.from_unit({smallest.x, smallest.y, smallest.z});
  for (int k = 0; k < 3; ++k) {
    const double low = solid.bounds().min()[k], high = solid.bounds().max()[k];
    centre[k] = std::clamp(centre[k], low, high);
    header.ball_centre[k] = centre[k];
    // Rounding, in this frame or in the unit frame, brings nothing back inside.
    constexpr double kFar = std::numeric_limits<double>::infinity();
    const double further = (beyond + 1e-14) * frame.scale();
    header.box_lower[k] = beyond > 0 ? std::nextafter(low - further, -kFar) : low;
    header.box_upper[k] = beyond > 0 ? std::nextafter(high + further, kFar) : high;
  }
  // About the centre as it is written, which far from the origin is not quite the smallest ball's.
  const Vector3d from = frame.to_unit(centre);
  double radius = 0;
  for (const Ball& point : points)
    radius = std::max(radius, reach(from.x(), from.y(), from.z(), point));
  header.ball_radius = (radius + beyond) * (1 + 0x1p-49) * frame.scale();
}

}  // namespace ist
