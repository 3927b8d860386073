#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "query/asset/sphere_tree.h"
#include "query/base/relative_pose.h"
#include "query/exact/mesh_tree.h"

namespace ist {

/// A triangle or a point, with bounds on the solid around it.
struct ConvexPiece {
  Eigen::Vector3d corner[3];
  int corners = 1;    ///< 1 or 3
  double beyond = 0;  ///< ≥ 0: this part of the solid lies within this distance of the piece
  /// From any point, the solid's distance exceeds that of a point of the piece by at most this. It
  /// is less by as much if this is negative.
  double behind = 0;
};

/// The convex hull of up to sixteen points.
struct PointHull {
  double x[kWidth], y[kWidth], z[kWidth];
  std::uint32_t count = 0;
};

/// A ball around the solid, or around its spheres. Unit frame.
RootBall root_ball(const AssetHeader& asset) noexcept;

/// A moving solid as a tree of balls: the triangles of its mesh or, if its asset has none, the
/// cover balls of its inner spheres. Unit frame. A level and a number identify a node, as in
/// SphereTree: at kSphereLevel one triangle or sphere, at the top level the whole solid.
class ImpactSide {
 public:
  explicit ImpactSide(const AssetView& view) noexcept;

  /// Null if the asset has none.
  const MeshTree* mesh() const noexcept { return mesh_ ? &*mesh_ : nullptr; }
  double mesh_error() const noexcept { return error_; }

  int top() const noexcept { return mesh_ ? mesh_->top : spheres_.top; }

  /// The number of children of a node, at most kWidth; their numbers begin at kWidth · number.
  std::uint32_t children(int level, std::uint32_t number) const noexcept;

  /// A ball around the solid's part at a node.
  NodeBall ball(int level, std::uint32_t number) const noexcept;

  /// True for nodes with a hull other than a ball: blocks of triangles, single ones, spheres.
  bool has_hull(int level) const noexcept { return level <= (mesh_ ? 0 : kSphereLevel); }
  /// The solid's part at a node lies within beyond(…) of this hull: the ball's centre if the node
  /// has no other.
  PointHull hull(int level, std::uint32_t number) const noexcept;
  double beyond(int level, std::uint32_t number) const noexcept;

  /// The piece of a node of kSphereLevel.
  ConvexPiece piece(std::uint32_t number) const noexcept;

 private:
  SphereTree spheres_;
  RootBall root_;
  std::optional<MeshTree> mesh_;
  double error_ = 0;  ///< of the mesh
};

/// True if a part of B lies inside A's mesh without an intersection of their surfaces.
bool contains_part(const MeshTree& a, const ImpactSide& b, const Similarity& a_from_b) noexcept;

/// The nearest points of two pieces, up to rounding; valid if they do not cross.
struct NearestPoints {
  Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = Eigen::Vector3d::Zero();
  double distance = 0;
};
NearestPoints nearest_points(const ConvexPiece& a, const ConvexPiece& b) noexcept;

Eigen::Vector3d nearest_in_piece(const ConvexPiece& piece, const Eigen::Vector3d& x) noexcept;

/// True if an edge of one triangle passes through the other.
bool triangles_cross(const ConvexPiece& a, const ConvexPiece& b) noexcept;

/// The gap between two pieces along a direction, from A to B. For a unit vector it is a lower bound
/// on their distance.
double apart_along(const Eigen::Vector3d& n, const ConvexPiece& a, const ConvexPiece& b) noexcept;

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

Eigen::Vector3d furthest(const PointHull& hull, const Eigen::Vector3d& n) noexcept;

/// A plane between two hulls, which are `apart` along its normal if that is positive.
struct HullPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, from A to B
  double apart = 0;
};

/// Searches for a plane that shows most of the distance, from a guess of the direction from A to B.
/// Finds none if the hulls are no further apart than `least`.
HullPlane plane_between(const PointHull& a, const PointHull& b, const Eigen::Vector3d& guess,
                        double least) noexcept;

}  // namespace ist
