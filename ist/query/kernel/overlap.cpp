#include "query/kernel/overlap.h"

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
  overlap.error = 2 * M_PI * total(sums.error) + sum_rounding(precision) * overlap.volume;
  overlap.force = -2 * M_PI * total(sums.force);
  overlap.torque = -2 * M_PI * total(sums.torque);
  overlap.moment = M_PI / 3 * total(sums.moment);
  return overlap;
}

}  // namespace ist
