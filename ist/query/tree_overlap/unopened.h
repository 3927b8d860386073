#pragma once

#include <Eigen/Core>

#include "query/asset/sphere_tree.h"
#include "query/base/relative_pose.h"

namespace ist {

/// Bounds for a pair of nodes that was not opened, in A's unit frame.
struct PairEstimate {
  double bound = 0;   ///< the sum over all sphere pairs below is at most this (docs/design.md 7)
  double volume = 0;  ///< best guess: both nodes as balls of uniform density
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< d(volume)/d(translation of B)
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of the guessed overlap
};

/// PairEstimate::bound alone.
double bound_pair(const SphereTree& a, int level_a, std::uint32_t block_a, const SphereTree& b,
                  int level_b, std::uint32_t block_b, const Similarity& a_from_b) noexcept;

PairEstimate estimate_pair(const SphereTree& a, int level_a, std::uint32_t block_a,
                           const SphereTree& b, int level_b, std::uint32_t block_b,
                           const Similarity& a_from_b) noexcept;

}  // namespace ist
