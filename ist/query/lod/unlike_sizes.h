#pragma once

#include <algorithm>
#include <optional>

#include <ist/query.h>

#include "query/base/budget.h"
#include "query/base/relative_pose.h"
#include "query/scratch/workspace.h"

namespace ist {

/// The method for the penetration of two solids (docs/design.md 7.1). Does not depend on the pose.
struct PairMethod {
  bool spheres = true;
  bool exact = false;  ///< uses the meshes where spheres are too coarse
  /// The spheres' overlap, A's unit frame, up to which the meshes have their full weight, and from
  /// which on they have none.
  double full = 0, none = 0;
  double share = 1;  ///< the meshes' full weight, less than 1 for nearly equal feature sizes
};

/// The fraction of a solid that inner spheres cover; at least 0.01.
inline double covered_part(const AssetHeader& asset) noexcept {
  return std::max(asset.coverage, 0.01);
}

/// Without a pose the method depends on the settings alone.
PairMethod pair_method(const PlacedAsset& a, const PlacedAsset& b,
                       const PenetrationSettings& settings,
                       const std::optional<RelativePose>& pose) noexcept;

/// The exact measure's weight by the spheres' volume, its slope, and its bounds by the bounds on
/// that volume. A's unit frame.
struct ExactWeight {
  double weight = 1, slope = 0;
  double least = 1, most = 1;
};
ExactWeight exact_weight(const PairMethod& method, const Penetration& spheres,
                         double unit3) noexcept;

/// The settings of the exact query after spheres have spent `spent` visits; empty if none is left.
std::optional<PenetrationSettings> left_for_exact(PenetrationSettings settings,
                                                  std::uint32_t spent) noexcept;

/// The spheres' answer if no visits are left for the exact query.
Penetration without_exact(const PlacedAsset& a, const PlacedAsset& b, Penetration spheres) noexcept;

/// Both answers by weight, with the counts of both. `unit3`: [u³] volume of A's unit.
Penetration blended(const Penetration& spheres, Penetration exact, const ExactWeight& weight,
                    double unit3) noexcept;

/// The sum of lenses of two trees of placed assets.
Penetration lens_sum(const PlacedAsset& a, const TreeHeader& tree_a, const PlacedAsset& b,
                     const TreeHeader& tree_b, const RelativePose& pose,
                     const DescentLimits& limits, Workspace::Impl& scratch) noexcept;

}  // namespace ist
