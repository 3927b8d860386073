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

Overlap whole_spheres(const SubtreeSums& spheres, const Similarity& a_from_b) noexcept {
  Overlap overlap;
  if (spheres.spheres == 0) return overlap;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (std::size_t lane = 0; lane < kWidth; ++lane) {
    overlap.volume += spheres.cubes[lane];
    for (int k = 0; k < 3; ++k) moment[k] += spheres.moment[k][lane];
  }
  const double cube = a_from_b.scale * a_from_b.scale * a_from_b.scale;
  overlap.volume *= kBallVolume;
  overlap.volume *= cube;
  moment *= kBallVolume;
  const double* const m = a_from_b.m;
  for (int k = 0; k < 3; ++k)
    overlap.moment[k] =
        cube * ((m[3 * k] * moment[0] + m[3 * k + 1] * moment[1]) + m[3 * k + 2] * moment[2]);
  return overlap;
}

}  // namespace ist
