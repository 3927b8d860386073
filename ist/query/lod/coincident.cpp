#include "query/lod/coincident.h"

#include <algorithm>

namespace ist {

Penetration mix(const Penetration& x, const Penetration& y, double weight) noexcept {
  const double rest = 1 - weight;
  Penetration result;
  result.volume = rest * x.volume + weight * y.volume;
  result.volume_min = rest * x.volume_min + weight * y.volume_min;
  result.volume_max = rest * x.volume_max + weight * y.volume_max;
  if (result.volume > 0)
    result.centroid = x.centroid + (weight * y.volume / result.volume) * (y.centroid - x.centroid);
  result.force = rest * x.force + weight * y.force;
  result.torque = rest * x.torque + weight * y.torque;
  result.status = std::max(x.status, y.status);
  result.node_visits = x.node_visits + y.node_visits;
  result.sphere_pairs = x.sphere_pairs + y.sphere_pairs;
  return result;
}

void add_slope(const PoseSlope& slope, double step, const RelativePose& pose,
               Penetration& mixed) noexcept {
  const Vec3 push = turned(step / pose.unit_a, pose.rotation_a, slope.by_translation);
  mixed.force -= vector(push);
  mixed.torque -=
      vector(turned(step, pose.rotation_a, slope.by_rotation) + cross(pose.offset_b, push));
}

}  // namespace ist
