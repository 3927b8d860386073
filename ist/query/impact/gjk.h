#pragma once

#include <Eigen/Core>

namespace ist {

/// The shortest way between two convex sets, from A to B, by differences of their points (Gilbert,
/// Johnson and Keerthi 1988).
class WayBetween {
 public:
  /// Adds the difference of a point of the triangle and one of the core. False if it leads no
  /// nearer.
  bool add(const Eigen::Vector3d& difference, const Eigen::Vector3d& of_triangle) noexcept;

  const Eigen::Vector3d& way() const noexcept { return way_; }
  /// The point of B that the way leads to.
  const Eigen::Vector3d& point() const noexcept { return point_; }

 private:
  int count_ = 0;  ///< differences kept, whose hull the way leads to
  Eigen::Vector3d difference_[4], of_b_[4];
  Eigen::Vector3d way_ = Eigen::Vector3d::Zero(), point_ = Eigen::Vector3d::Zero();
};

}  // namespace ist
