#pragma once

#include <Eigen/Core>

#include <ist/query.h>
#include <ist/types.h>

namespace IST_API ist {

/// A solid of density 1 as a rigid body. Multiply by a density for mass and inertia.
///
/// They are the solid's, not its spheres'. For a mesh without self-intersections they are exact to
/// rounding, by the divergence theorem, and the errors bound the rounding. For a self-intersecting
/// mesh the solid is where the winding number is ≥ 1, and the errors include those of an
/// integration. For a solid without a mesh they are those of the mesh in its place, and the errors
/// include the proven distance of the two.
struct MassProperties {
  double volume = 0;                                         ///< [u³]
  Eigen::Vector3d centre_of_mass = Eigen::Vector3d::Zero();  ///< [u]
  /// [u⁵] About the centre of mass: ∫ (|y|² 1 − y yᵀ); off-diagonal entries are −∫ x y, ….
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  double volume_error = 0;          ///< [u³]
  double centre_of_mass_error = 0;  ///< [u] of each component
  double inertia_error = 0;         ///< [u⁵] of each entry
};

/// Bounds of a solid, for a broad phase. Matched spheres may stick out by AssetView::protrusion():
/// two solids whose bounds are further apart than both protrusions have no penetration in any
/// measure.
struct Bounds {
  Eigen::Vector3d lower = Eigen::Vector3d::Zero();   ///< [u] corner of the box along the axes
  Eigen::Vector3d upper = Eigen::Vector3d::Zero();   ///< [u] the opposite corner
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< [u] of the ball
  double radius = 0;  ///< [u] of the ball: the smallest one or slightly larger
};

/// In the asset's own frame; all zero for an empty view.
///
/// Stored by the bake: takes nanoseconds. For solids more than 1e60 [u] across the inertia is
/// infinite, under 1e-60 [u] zero.
MassProperties mass_properties(const AssetView& tree) noexcept;

/// In the asset's own frame; all zero for an empty view. The box is the mesh's, to the last digit.
Bounds bounds(const AssetView& tree) noexcept;

/// In the world frame, axes included: under a scale s the volume is s³ times as large, the inertia
/// s⁵ times. All NaN for an empty tree, and for an invalid pose or scale. The errors do not
/// include the rounding of the motion.
MassProperties mass_properties(const PlacedAsset& placed) noexcept;

/// In the world frame: the box along the world's axes around the rotated box, and the ball.
/// Rounding is not added. All NaN as above.
Bounds bounds(const PlacedAsset& placed) noexcept;

/// The feature sizes of two assets, compared independently of their poses.
struct SizeMatch {
  /// [u] under the objects' scales: mean radius of the matched spheres, over the share of the solid
  /// that inner spheres cover. The spheres do not resolve finer features.
  double feature_size_a = 0, feature_size_b = 0;
  double ratio = 1;          ///< ≥ 1, coarser feature size over the finer
  bool a_is_coarser = true;  ///< or both are equal
  bool has_mesh = true;      ///< both assets store their meshes (AssetView::has_mesh)
  /// The ratio is 4 or more: volumes and forces by spheres alone are misleading. With both meshes
  /// Measure::matched goes over to these (PenetrationSettings::spheres_only).
  bool needs_mesh = false;

  bool fits() const noexcept { return has_mesh || !needs_mesh; }
};

/// Takes nanoseconds. For empty trees, and scales that are not > 0, all members have their
/// defaults.
SizeMatch size_match(const PlacedAsset& a, const PlacedAsset& b) noexcept;

}  // namespace ist
