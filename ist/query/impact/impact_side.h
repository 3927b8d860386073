#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "query/asset/sphere_tree.h"
#include "query/base/relative_pose.h"
#include "query/exact/mesh_tree.h"

namespace ist {

/// A triangle or a point, and what it tells of the solid around it.
struct ConvexPiece {
  Eigen::Vector3d corner[3];
  int corners = 1;    ///< 1 or 3
  double beyond = 0;  ///< ≥ 0: what the solid has here lies within this of the piece
  /// For two points, one of them in the piece, the solid has a point whose distance to the other is
  /// larger by at most this; smaller if this is negative.
  double behind = 0;
};

/// The convex hull of up to sixteen points.
struct PointHull {
  double x[kWidth], y[kWidth], z[kWidth];
  std::uint32_t count = 0;
};

/// A moving solid as a tree of balls: the triangles of its mesh or, if its asset has none, the
/// cover balls of its inner spheres. Unit frame. A node is named by a level and a number, as in
/// SphereTree; at kSphereLevel it is one triangle or sphere, and the node of the top level is the
/// whole.
class ImpactSide {
 public:
  explicit ImpactSide(const AssetView& view) noexcept;

  /// Null if the asset has none.
  const MeshTree* mesh() const noexcept { return mesh_ ? &*mesh_ : nullptr; }
  double mesh_error() const noexcept { return error_; }

  int top() const noexcept { return mesh_ ? mesh_->top : spheres_.top; }

  /// Nodes below a node, at most kWidth, whose numbers go on from kWidth · number.
  std::uint32_t children(int level, std::uint32_t number) const noexcept;

  /// A ball around all that the solid has at a node.
  NodeBall ball(int level, std::uint32_t number) const noexcept;

  /// Whether a node is known by more than its ball: blocks of triangles, single ones, spheres.
  bool has_hull(int level) const noexcept { return level <= (mesh_ ? 0 : kSphereLevel); }
  /// The solid's part at a node lies within beyond(…) of this hull; the ball's centre if there is
  /// none.
  PointHull hull(int level, std::uint32_t number) const noexcept;
  double beyond(int level, std::uint32_t number) const noexcept;

  /// The piece of a node of kSphereLevel.
  ConvexPiece piece(std::uint32_t number) const noexcept;

 private:
  SphereTree spheres_;
  std::optional<MeshTree> mesh_;
  double error_ = 0;  ///< of the mesh
};

/// Whether something of B lies inside A's mesh, where B's surface meets it nowhere.
bool holds_part(const MeshTree& a, const ImpactSide& b, const Similarity& a_from_b) noexcept;

}  // namespace ist
