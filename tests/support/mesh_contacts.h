#pragma once

#include <Eigen/Core>
#include <cstddef>

namespace ist::testing {

/// A mesh library's answer for two surfaces: contacts where triangles cross, without an inside.
/// Sums over all contacts that it reports.
struct MeshContacts {
  std::size_t count = 0;
  double depth_sum = 0;  ///< [u] Σ depth, ≥ 0
  /// [u] Σ depth · unit normal, the direction in which B is pushed, world.
  Eigen::Vector3d push_b = Eigen::Vector3d::Zero();

  bool any() const { return count > 0; }
};

}  // namespace ist::testing
