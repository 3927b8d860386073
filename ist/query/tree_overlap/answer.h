#pragma once

#include <algorithm>

#include <ist/query.h>

#include "query/base/relative_pose.h"
#include "query/kernel/overlap.h"

namespace ist {

/// The overlap in world units, its volume limited to the bounds, A's unit frame.
inline Penetration world_answer(const Overlap& overlap, double lowest, double highest,
                                const RelativePose& pose) noexcept {
  const double unit3 = pose.unit3();
  const WorldSums sums = overlap.in_world(pose);
  Penetration result;
  result.volume = unit3 * std::clamp(overlap.volume, lowest, highest);
  result.volume_min = unit3 * lowest;
  result.volume_max = unit3 * highest;
  result.centroid = vector(sums.centroid);
  result.force = -vector(sums.translation_gradient);
  result.torque = -vector(sums.rotation_gradient);
  return result;
}

/// Limits the volume of a stopped answer to `most` [u³], and scales its force and torque alike.
inline Penetration kept_within(double most, Penetration answer) noexcept {
  if (answer.status == QueryStatus::ok || !(answer.volume > most)) return answer;
  const double factor = most / answer.volume;
  answer.volume = most;
  answer.volume_min = std::min(answer.volume_min, most);
  answer.force *= factor;
  answer.torque *= factor;
  return answer;
}

}  // namespace ist
