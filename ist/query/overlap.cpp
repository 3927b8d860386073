#include "query/overlap.h"

#include <cmath>

namespace ist {
namespace {

double total(const double (&lanes)[kSumLanes]) {
  double sum = 0;
  for (const double lane : lanes) sum += lane;
  return sum;
}

Eigen::Vector3d total(const double (&lanes)[3][kSumLanes]) {
  return {total(lanes[0]), total(lanes[1]), total(lanes[2])};
}

}  // namespace

Overlap finish(const LeafSums& sums, Precision precision) noexcept {
  Overlap overlap;
  overlap.volume = M_PI / 3 * total(sums.caps);
  // A lens is good to a few units in the last place, and at most 33 of them meet in one lane
  // before the sum goes on in double.
  const double relative = precision == Precision::single ? 4e-6 : 1e-14;
  overlap.error = 2 * M_PI * total(sums.error) + relative * overlap.volume;
  overlap.force = -2 * M_PI * total(sums.force);
  overlap.torque = -2 * M_PI * total(sums.torque);
  overlap.moment = M_PI / 3 * total(sums.moment);
  return overlap;
}

}  // namespace ist
