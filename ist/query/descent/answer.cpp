#include "query/descent/answer.h"

#include <algorithm>

namespace ist {

Penetration world_answer(const Overlap& overlap, double lowest, double highest,
                         const RelativePose& pose) noexcept {
  const double unit3 = pose.unit3();
  const WorldSums sums = overlap.in_world(pose);
  Penetration result;
  result.volume = unit3 * std::clamp(overlap.volume, lowest, highest);
  result.volume_min = unit3 * lowest;
  result.volume_max = unit3 * highest;
  result.centroid = vector(sums.centroid);
  result.translation_gradient = vector(sums.translation_gradient);
  result.rotation_gradient = vector(sums.rotation_gradient);
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
