#pragma once

#include <Eigen/Core>
#include <functional>

#include "mesh/geometry/mesh_view.h"

namespace ist {

/// Returns a mesh with its hierarchy, from any thread.
using HierarchyMaker = std::function<const MeshView&()>;

/// ∫ of 1, x, y, z, x², y², z², xy, xz, yz over a set, unit frame.
using Moments = Eigen::Array<double, 10, 1>;

/// The excess of a mesh over its solid: ∫ (winding − [winding ≥ 1]) of the ten integrands.
struct WindingExcess {
  Moments value = Moments::Zero();
  Moments error = Moments::Zero();  ///< estimate: the bends of the last intervals, without signs
  double hidden = 0;  ///< volume that a fold between the columns may hide, with 95 % confidence
};

/// Integrated exactly along x and adaptively along y and z, by the volume's bends. Deterministic.
/// `mesh` may lack its hierarchy, which is requested only if there is an excess.
WindingExcess winding_excess(const MeshView& mesh, const HierarchyMaker& hierarchy);

/// Volume, centre of mass and inertia of a solid of density 1, unit frame, and bounds of their
/// errors.
struct MeshMoments {
  double volume = 0;
  double volume_error = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double centre_error = 0;  ///< of each component
  /// ∫ (|y|² 1 − y yᵀ), y from the centre.
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  double inertia_error = 0;  ///< of each entry
};

/// The moments of a mesh by the divergence theorem: ∫ winding number. The errors are proven bounds
/// on the rounding. If the winding number is only 0 or 1, they are those of the solid.
/// Deterministic.
MeshMoments enclosed_moments(const MeshView& mesh);

/// The moments of the set with winding number ≥ 1 (docs/design.md 3.6): the enclosed ones less the
/// excess, without which no accuracy is lost. The errors include the estimated error of the
/// excess's integral and, unless `meets_itself` is false, what folds may hide between its columns.
/// Deterministic. `mesh`, `hierarchy`: as above.
MeshMoments winding_set_moments(const MeshView& mesh, bool meets_itself,
                                const HierarchyMaker& hierarchy);

/// Bound on the volume within `distance` of the surface: Steiner's formula for each triangle.
double slab_volume(const MeshView& mesh, double distance);

/// The same for a solid that agrees with the mesh's at all points further than `distance` from its
/// surface: the errors of centre and inertia grow by what may lie within that distance, the
/// volume's does not.
MeshMoments moments_near(const MeshView& mesh, MeshMoments moments, double distance);

}  // namespace ist
