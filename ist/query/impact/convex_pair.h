#pragma once

#include <Eigen/Core>

#include "query/impact/impact_side.h"

namespace ist {

/// The nearest points of two pieces, up to rounding; valid if they do not cross.
struct NearestPoints {
  Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = Eigen::Vector3d::Zero();
  double distance = 0;
};
NearestPoints nearest_points(const ConvexPiece& a, const ConvexPiece& b) noexcept;

/// The point of a piece that is nearest to x.
Eigen::Vector3d nearest_in_piece(const ConvexPiece& piece, const Eigen::Vector3d& x) noexcept;

/// True if an edge of one triangle passes through the other.
bool triangles_cross(const ConvexPiece& a, const ConvexPiece& b) noexcept;

/// The gap between two pieces along a direction, from A to B. For a unit vector it is a lower bound
/// on their distance.
double apart_along(const Eigen::Vector3d& n, const ConvexPiece& a, const ConvexPiece& b) noexcept;

}  // namespace ist
