#pragma once

#include <Eigen/Core>
#include <numbers>

#include "query/base/pair_place.h"
#include "query/base/relative_pose.h"
#include "query/kernel/leaf_kernel.h"
#include "query/kernel/node_kernel.h"

namespace ist {

/// The overlap of two trees or parts of them, in A's axes, relative to B's unit-frame origin.
struct Overlap {
  double volume = 0;
  double error = 0;                                  ///< bound on the rounding of `volume`
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< d(volume)/d(translation of B)
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  ///< likewise about B's unit-frame origin
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  ///< ∫ x dV

  /// Leaves out `error`.
  void add(const Overlap& other) noexcept {
    volume += other.volume;
    force += other.force;
    torque += other.torque;
    moment += other.moment;
  }

  WorldSums in_world(const PairPlace& place) const noexcept {
    return WorldSums::of(place, volume, plain(force), plain(torque), plain(moment));
  }
};

/// Relative rounding of a sum of lenses. A lens is accurate to a few units in the last place, and
/// at most 18 of them are added in one lane before the sum continues in double.
constexpr double sum_rounding(Precision precision) {
  return precision == Precision::float32 ? 4e-6 : 1e-14;
}

/// Adds up the lanes and applies the factors of π.
inline Overlap finish(const LeafSums& sums, Precision precision) noexcept {
  const auto total = [](const double(&lanes)[kSumLanes]) {
    double sum = 0;
    for (const double lane : lanes) sum += lane;
    return sum;
  };
  const auto vector_total = [&](const double(&lanes)[3][kSumLanes]) -> Eigen::Vector3d {
    return {total(lanes[0]), total(lanes[1]), total(lanes[2])};
  };
  Overlap overlap;
  overlap.volume = std::numbers::pi / 3 * total(sums.caps);
  overlap.error =
      2 * std::numbers::pi * total(sums.error) + sum_rounding(precision) * overlap.volume;
  overlap.force = -2 * std::numbers::pi * vector_total(sums.force);
  overlap.torque = -2 * std::numbers::pi * vector_total(sums.torque);
  overlap.moment = std::numbers::pi / 3 * vector_total(sums.moment);
  return overlap;
}

/// The overlap of whole spheres of B, with sums in B's unit frame.
inline Overlap whole_spheres(const SubtreeSums& spheres, const Similarity& a_from_b) noexcept {
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
