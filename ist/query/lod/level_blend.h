#pragma once

#include <ist/query.h>

#include "query/base/budget.h"
#include "query/base/relative_pose.h"
#include "query/lod/coincident.h"
#include "query/lod/level_chain.h"
#include "query/lod/wanted_error.h"

namespace ist {

/// Computes the part of a blend with the largest weight, which contact patches sort into bins.
class LargestPart {
 public:
  /// A pair of levels, in place of lens_sum().
  virtual Penetration level(const LevelPair& pair, const DescentLimits& limits) noexcept = 0;
  /// The exact measure, in place of ExactMeasure.
  virtual Penetration exact(const PenetrationSettings& settings) noexcept = 0;

 protected:
  ~LargestPart() = default;
};

/// penetration() by Measure::exact, a function above this folder.
using ExactMeasure = Penetration (*)(const PlacedAsset& a, const PlacedAsset& b,
                                     const PenetrationSettings& settings, const RelativePose& pose,
                                     Workspace& workspace) noexcept;

/// True if the answer of matched spheres depends on other levels than the finest.
inline bool asks_levels(const PlacedAsset& a, const PlacedAsset& b,
                        const PenetrationSettings& settings) noexcept {
  return settings.pair_budget > 0 || by_error(settings) ||
         are_one_asset(a.asset.header(), b.asset.header());
}

/// The penetration by levels of detail. Under a wanted error levels and the exact measure are
/// blended by their errors (WantedError), under a pair budget levels by their costs (LevelChain);
/// without either the finest answers. Copies of one asset that nearly coincide use unlike levels
/// (CoincidenceWeight). The gradients are those of the blended sum. `largest`: null if that part is
/// summed as the others. No allocation, lock or exception.
Penetration blend_levels(const PlacedAsset& a, const PlacedAsset& b, const RelativePose& pose,
                         const PenetrationSettings& settings, Workspace& workspace,
                         ExactMeasure exact, LargestPart* largest = nullptr) noexcept;

}  // namespace ist
