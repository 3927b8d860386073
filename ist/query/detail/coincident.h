#pragma once

#include <Eigen/Core>

#include <ist/query.h>

#include <ist/asset_layout.h>
#include "query/base/relative_pose.h"

namespace ist {

/// How nearly two copies of one asset coincide. Sphere upon equal sphere, the sum of lenses counts
/// ∫ρ² where ρ, the number of spheres at a point, is 1 in the mean but not everywhere: 5 to 10 %
/// too much (docs/design.md 5). A level of detail against the next coarser one has nothing of the
/// kind: its spheres are others. So as copies come to coincide, such unlike levels take over: the
/// mean of both ways round, which has no force where the copies coincide.
struct CoincidenceWeight {
  double weight = 0;  ///< [0, 1] part of the unlike levels; 0 from 1.6 mean radii of way on
  Eigen::Vector3d by_translation = Eigen::Vector3d::Zero();  ///< slope, A's unit frame
  /// Likewise by a rotation of B about its unit-frame origin.
  Eigen::Vector3d by_rotation = Eigen::Vector3d::Zero();
};

/// Whether both are the same bytes, and hold a coarser level.
inline bool are_one_asset(const AssetHeader& a, const AssetHeader& b) noexcept {
  return a.detail_count > 0 &&
         (&a == &b || (a.content_hash == b.content_hash && a.file_bytes == b.file_bytes));
}

/// The weight for two copies of a tree: smooth in the pose, by the root mean square way between
/// equal points of the two, as if the tree filled its root ball.
CoincidenceWeight coincidence_weight(const TreeHeader& tree, const Similarity& a_from_b) noexcept;

/// (1 − weight) of x and the weight's part of y.
Penetration mix(const Penetration& x, const Penetration& y, double weight) noexcept;

/// Adds to the gradients of a mix of coincident copies' answers what the weight's slope makes of
/// the step from one to the other [u³].
void add_slope(const CoincidenceWeight& weight, double step, const RelativePose& pose,
               Penetration& mixed) noexcept;

}  // namespace ist
