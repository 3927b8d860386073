#pragma once

#include <Eigen/Core>

#include "query/base/relative_pose.h"
#include "query/base/world_sums.h"
#include "query/kernel/leaf_kernel.h"
#include "query/kernel/subtree_kernel.h"

namespace ist {

/// Overlap of two trees or of parts of them, in A's unit frame; positions relative to B's
/// unit-frame origin.
struct Overlap {
  double volume = 0;
  double error = 0;                                  ///< bound on the rounding of `volume`
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< d(volume)/d(translation of B)
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  ///< likewise about B's unit-frame origin
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  ///< ∫ x dV

  /// All but `error`.
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

/// Relative rounding of a sum of lenses. A lens is good to a few units in the last place, and at
/// most 18 of them meet in one lane before the sum goes on in double.
constexpr double sum_rounding(Precision precision) {
  return precision == Precision::float32 ? 4e-6 : 1e-14;
}

/// Adds up the lanes and sets in the factors of π.
Overlap finish(const LeafSums& sums, Precision precision) noexcept;

/// Whole spheres of B, whose sums are in its own unit frame.
Overlap whole_spheres(const SubtreeSums& spheres, const Similarity& a_from_b) noexcept;

}  // namespace ist
