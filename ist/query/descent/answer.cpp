#include "query/descent/answer.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace ist {

Penetration world_answer(const Overlap& overlap, double lowest, double highest,
                         const RelativePose& pose) noexcept {
  const double unit = pose.unit_a;
  const double unit3 = unit * unit * unit;
  Penetration result;
  result.volume = unit3 * std::clamp(overlap.volume, lowest, highest);
  result.volume_min = unit3 * lowest;
  result.volume_max = unit3 * highest;
  if (overlap.volume > 0) {
    const Eigen::Vector3d origin_b(pose.a_from_b.t[0], pose.a_from_b.t[1], pose.a_from_b.t[2]);
    result.centroid = pose.to_world(overlap.moment / overlap.volume + origin_b);
  }
  result.translation_gradient = unit * unit * (pose.rotation_a * overlap.force);
  result.rotation_gradient = unit3 * (pose.rotation_a * overlap.torque) +
                             pose.unit_offset_b.cross(result.translation_gradient);
  return result;
}

Penetration kept_within(double most, Penetration answer) noexcept {
  if (answer.status == QueryStatus::ok || !(answer.volume > most)) return answer;
  const double factor = most / answer.volume;
  answer.volume = most;
  answer.volume_min = std::min(answer.volume_min, most);
  answer.translation_gradient *= factor;
  answer.rotation_gradient *= factor;
  return answer;
}

}  // namespace ist
