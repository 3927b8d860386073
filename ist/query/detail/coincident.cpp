#include "query/detail/coincident.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "query/asset/shared_constants.h"
#include "query/base/smooth_step.h"

namespace ist {
CoincidenceWeight coincidence_weight(const TreeHeader& tree, const Similarity& a_from_b) noexcept {
  const double(&m)[9] = a_from_b.m;
  const double centre[3] = {tree.root[0], tree.root[1], tree.root[2]};
  double moved[3];
  a_from_b.apply(centre, moved);
  const Eigen::Vector3d way(moved[0] - centre[0], moved[1] - centre[1], moved[2] - centre[2]);
  const Eigen::Vector3d lever(moved[0] - a_from_b.t[0], moved[1] - a_from_b.t[1],
                              moved[2] - a_from_b.t[2]);
  // Of a ball's points the mean square by each axis is r²/5.
  const double spread = tree.root[3] * tree.root[3] / 5;
  const double scale = a_from_b.scale;
  const double turned = 3 * (scale * scale + 1) - 2 * ((m[0] + m[4]) + m[8]);
  const double square = way.squaredNorm() + spread * std::max(turned, 0.0);
  const double radius = tree.mean_radius;
  CoincidenceWeight result;
  if (!(square < (kCopyApart * kCopyApart) * (radius * radius))) return result;
  const double distance = std::sqrt(square);
  const double t = std::min((kCopyApart - distance / radius) / (kCopyApart - kCopyAlone), 1.0);
  result.weight = smooth_step(t);
  if (t == 1) return result;
  const double slope = -6 * t * (1 - t) / ((kCopyApart - kCopyAlone) * radius) / distance;
  result.slope.by_translation = slope * way;
  result.slope.by_rotation =
      slope * (lever.cross(way) - spread * Eigen::Vector3d(m[5] - m[7], m[6] - m[2], m[1] - m[3]));
  return result;
}

Penetration mix(const Penetration& x, const Penetration& y, double weight) noexcept {
  const double rest = 1 - weight;
  Penetration result;
  result.volume = rest * x.volume + weight * y.volume;
  result.volume_min = rest * x.volume_min + weight * y.volume_min;
  result.volume_max = rest * x.volume_max + weight * y.volume_max;
  if (result.volume > 0)
    result.centroid = x.centroid + (weight * y.volume / result.volume) * (y.centroid - x.centroid);
  result.translation_gradient = rest * x.translation_gradient + weight * y.translation_gradient;
  result.rotation_gradient = rest * x.rotation_gradient + weight * y.rotation_gradient;
  result.status = std::max(x.status, y.status);
  result.node_visits = x.node_visits + y.node_visits;
  result.sphere_pairs = x.sphere_pairs + y.sphere_pairs;
  return result;
}

void add_slope(const PoseSlope& slope, double step, const RelativePose& pose,
               Penetration& mixed) noexcept {
  const Eigen::Vector3d push = step / pose.unit_a * (pose.rotation_a * slope.by_translation);
  mixed.translation_gradient += push;
  mixed.rotation_gradient +=
      step * (pose.rotation_a * slope.by_rotation) + pose.unit_offset_b.cross(push);
}

}  // namespace ist
