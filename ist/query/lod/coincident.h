#pragma once

#include <algorithm>

#include <ist/query.h>
#include "query/base/relative_pose.h"
#include "query/lod/coincidence.h"

namespace ist {

/// True if both are the same bytes and contain a coarser level.
inline bool are_one_asset(const AssetHeader& a, const AssetHeader& b) noexcept {
  return a.detail_count > 0 &&
         (&a == &b || (a.content_hash == b.content_hash && a.file_bytes == b.file_bytes));
}

/// (1 − weight) · x + weight · y.
inline Penetration mix(const Penetration& x, const Penetration& y, double weight) noexcept {
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

/// Adds the gradients of a mix by its weight. `step`: [u³] growth of the mix over weights 0 to 1.
inline void add_slope(const PoseSlope& slope, double step, const RelativePose& pose,
                      Penetration& mixed) noexcept {
  const Vec3 push = turned(step / pose.unit_a, pose.rotation_a, slope.by_translation);
  mixed.force -= vector(push);
  mixed.torque -=
      vector(turned(step, pose.rotation_a, slope.by_rotation) + cross(pose.offset_b, push));
}

}  // namespace ist
