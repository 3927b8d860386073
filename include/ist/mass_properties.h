#pragma once

#include <Eigen/Core>

#include <ist/api.h>
#include <ist/query.h>

namespace IST_API ist {

/// A solid of density 1 as a rigid body. Times a density: mass, and inertia of that mass.
///
/// They are the solid's, not its spheres': exact to rounding for a mesh that does not meet itself,
/// by the divergence theorem.
/// The errors are bounds on the rounding then.
/// Of a mesh that meets itself, the solid is where the winding number is ≥ 1, and the errors hold
/// those of an integration.
/// Of a solid without a mesh, all is the mesh's in its place, and the errors hold what may lie
/// between the two.
struct MassProperties {
  double volume = 0;                                         ///< [u³]
  Eigen::Vector3d centre_of_mass = Eigen::Vector3d::Zero();  ///< [u]
  /// [u⁵] About the centre of mass: ∫ (|y|² 1 − y yᵀ), so that off the diagonal stand −∫ x y, ….
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  double volume_error = 0;          ///< [u³]
  double centre_of_mass_error = 0;  ///< [u] of each component
  double inertia_error = 0;         ///< [u⁵] of each entry
};

/// What holds a solid. Matched spheres may stick out of it by TreeView::protrusion(): two solids
/// whose bounds are further apart than both protrusions have no penetration in any measure.
struct Bounds {
  Eigen::Vector3d lower = Eigen::Vector3d::Zero();   ///< [u] corner of the box along the axes
  Eigen::Vector3d upper = Eigen::Vector3d::Zero();   ///< [u] the opposite corner
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< [u] of the ball
  double radius = 0;  ///< [u] of the ball, which is the smallest one or hardly larger
};

/// In the asset's own frame; all zero for an empty view.
///
/// Stored by the bake: takes nanoseconds.
/// Of solids more than 1e60 [u] across the inertia is infinite, under 1e-60 [u] zero.
MassProperties mass_properties(const TreeView& tree) noexcept;

/// In the asset's own frame; all zero for an empty view. The box is the mesh's, to the last digit.
Bounds bounds(const TreeView& tree) noexcept;

/// In the world, axes included: under a scale s the volume is s³ times as large, the inertia s⁵
/// times. All zero for an empty tree, and for a pose or a scale that a query calls invalid.
/// Rounding of the motion is not in the errors.
MassProperties mass_properties(const PlacedTree& placed) noexcept;

/// In the world: the box along the world's axes around the turned box, and the ball. Rounding is
/// not added. All zero as above.
Bounds bounds(const PlacedTree& placed) noexcept;

}  // namespace ist
