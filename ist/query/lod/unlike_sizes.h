#pragma once

#include <algorithm>
#include <optional>

#include <ist/query.h>

#include "query/base/budget.h"
#include "query/base/relative_pose.h"
#include "query/scratch/workspace.h"

namespace ist {

/// How the penetration of two solids is found (docs/design.md 7.1). The pose has no say in it.
struct PairMethod {
  bool spheres = true;
  bool exact = false;  ///< the meshes, where spheres are too coarse
  /// Overlap by spheres, A's unit frame: up to `full` the meshes answer alone, from `none` on the
  /// spheres do.
  double full = 0, none = 0;
  double share = 1;  ///< what "alone" is of trees that are all but alike: the rest is the spheres'
};

/// The part of a solid that inner spheres cover, or the least that counts.
inline double covered_part(const AssetHeader& asset) noexcept {
  return std::max(asset.coverage, 0.01);
}

/// Without a pose by what was asked for alone.
PairMethod pair_method(const PlacedAsset& a, const PlacedAsset& b,
                       const PenetrationSettings& settings,
                       const std::optional<RelativePose>& pose) noexcept;

/// The exact measure's weight by what spheres say, A's unit frame, and its slope by that. The
/// finished sum's weight lies from `least` to `most`.
struct ExactWeight {
  double weight = 1, slope = 0;
  double least = 1, most = 1;
};
ExactWeight exact_weight(const PairMethod& method, const Penetration& spheres,
                         double unit3) noexcept;

/// The settings of the exact query after spheres have spent so many visits; nothing if none is
/// left.
std::optional<PenetrationSettings> left_for_exact(PenetrationSettings settings,
                                                  std::uint32_t spent) noexcept;

/// The spheres' answer if no visits are left for the exact query.
Penetration without_exact(const PlacedAsset& a, const PlacedAsset& b, Penetration spheres) noexcept;

/// Both sums by weight, with the counts of both. `unit3`: volume of A's unit.
Penetration blended(const Penetration& spheres, Penetration exact, const ExactWeight& weight,
                    double unit3) noexcept;

/// The sum of lenses of two trees of placed assets.
Penetration lens_sum(const PlacedAsset& a, const TreeHeader& tree_a, const PlacedAsset& b,
                     const TreeHeader& tree_b, const RelativePose& pose,
                     const DescentLimits& limits, Workspace::Impl& scratch) noexcept;

}  // namespace ist
