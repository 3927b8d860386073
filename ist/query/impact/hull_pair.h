#pragma once

#include <Eigen/Core>

#include "query/impact/impact_side.h"

namespace ist {

/// The point of a hull that is furthest along a direction.
Eigen::Vector3d furthest(const PointHull& hull, const Eigen::Vector3d& n) noexcept;

/// A plane between two hulls: `apart` of it is a proof, if it is positive.
struct HullPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, from A to B
  double apart = 0;
};

/// Looks for a plane that shows most of the distance, starting from a guess of the direction from A
/// to B; finds none if they are no further apart than `least`.
HullPlane plane_between(const PointHull& a, const PointHull& b, const Eigen::Vector3d& guess,
                        double least) noexcept;

}  // namespace ist
