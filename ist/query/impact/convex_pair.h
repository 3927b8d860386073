#pragma once

#include <Eigen/Core>

#include "query/impact/impact_side.h"

namespace ist {

/// The nearest points of two pieces, found to rounding where they do not cross.
struct NearestPoints {
  Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = Eigen::Vector3d::Zero();
  double distance = 0;
};
NearestPoints nearest_points(const ConvexPiece& a, const ConvexPiece& b) noexcept;

/// The point of a piece that is nearest to x.
Eigen::Vector3d nearest_in_piece(const ConvexPiece& piece, const Eigen::Vector3d& x) noexcept;

/// Whether an edge of one triangle goes through the other.
bool triangles_cross(const ConvexPiece& a, const ConvexPiece& b) noexcept;

/// How far two pieces lie apart along a direction, from A to B: a proof for any unit vector.
double apart_along(const Eigen::Vector3d& n, const ConvexPiece& a, const ConvexPiece& b) noexcept;

}  // namespace ist
