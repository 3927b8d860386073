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
  PoseSlope slope;
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

/// Adds `step` [u³] times a weight's slope to the gradients of a mix by it: `step` is what the mix
/// grows by as the weight goes from 0 to 1.
void add_slope(const PoseSlope& slope, double step, const RelativePose& pose,
               Penetration& mixed) noexcept;

}  // namespace ist
