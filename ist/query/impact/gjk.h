#pragma once

#include <Eigen/Core>

#include "query/impact/impact_side.h"

namespace ist {

/// The shortest displacement between two convex sets, from A to B, by differences of their points
/// (Gilbert, Johnson and Keerthi 1988).
class GjkDistance {
 public:
  /// Adds the difference of a point of B and one of A. False if it does not reduce the distance.
  bool add(const Eigen::Vector3d& difference, const Eigen::Vector3d& of_b) noexcept;

  const Eigen::Vector3d& shortest() const noexcept { return shortest_; }
  /// The point of B at its end.
  const Eigen::Vector3d& point() const noexcept { return point_; }

 private:
  int count_ = 0;  ///< differences kept; `shortest_` is the nearest point of their hull
  Eigen::Vector3d difference_[4], of_b_[4];
  Eigen::Vector3d shortest_ = Eigen::Vector3d::Zero(), point_ = Eigen::Vector3d::Zero();
};

/// The point of a hull that is furthest along a direction.
Eigen::Vector3d furthest(const PointHull& hull, const Eigen::Vector3d& n) noexcept;

/// A plane between two hulls, which are `apart` along its normal if that is positive.
struct HullPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, from A to B
  double apart = 0;
};

/// Searches for a plane that shows most of the distance, from a guess of the direction from A to B.
/// Finds none if they are no further apart than `least`.
HullPlane plane_between(const PointHull& a, const PointHull& b, const Eigen::Vector3d& guess,
                        double least) noexcept;

}  // namespace ist
