#pragma once

#include <Eigen/Core>

namespace ist {

/// The shortest displacement between two convex sets, from A to B, by differences of their points
/// (Gilbert, Johnson and Keerthi 1988).
class GjkDistance {
 public:
  /// Adds the difference of a point of the triangle and one of the core. False if it leads no
  /// nearer.
  bool add(const Eigen::Vector3d& difference, const Eigen::Vector3d& of_triangle) noexcept;

  const Eigen::Vector3d& shortest() const noexcept { return shortest_; }
  /// The point of B at its end.
  const Eigen::Vector3d& point() const noexcept { return point_; }

 private:
  int count_ = 0;  ///< differences kept; `shortest_` is the nearest point of their hull
  Eigen::Vector3d difference_[4], of_b_[4];
  Eigen::Vector3d shortest_ = Eigen::Vector3d::Zero(), point_ = Eigen::Vector3d::Zero();
};

}  // namespace ist
