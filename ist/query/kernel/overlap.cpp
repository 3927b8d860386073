#include "query/kernel/overlap.h"

#include <numbers>

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
  overlap.volume = std::numbers::pi / 3 * total(sums.caps);
  overlap.error =
      2 * std::numbers::pi * total(sums.error) + sum_rounding(precision) * overlap.volume;
  overlap.force = -2 * std::numbers::pi * total(sums.force);
  overlap.torque = -2 * std::numbers::pi * total(sums.torque);
  overlap.moment = std::numbers::pi / 3 * total(sums.moment);
  return overlap;
}

}  // namespace ist
