#pragma once

#include <ist/query.h>

#include "query/base/budget.h"
#include "query/base/relative_pose.h"
#include "query/detail/detail_chain.h"

namespace ist {

/// Sums of which a blend is made.
struct BlendSums {
  void* context;
  /// Sums the pair of levels of the largest weight, once, in place of PairOverlap::by(): contact
  /// patches sort it into bins. Null: it is summed as the others.
  Penetration (*level)(void* context, const DetailPair& pair, FieldUse use,
                       const DescentLimits& limits) noexcept;
  /// The exact measure, if both assets keep a mesh. `most`: its weight is the largest.
  Penetration (*exact)(void* context, std::uint32_t max_visits, bool most) noexcept;
};

/// The penetration from levels of detail. Under a wanted error they and the exact measure are
/// blended by what they err (WantedError), under a pair budget by what they need (DetailChain), and
/// without either the finest answers; copies of one asset that all but coincide are asked as unlike
/// levels (CoincidenceWeight). The gradients are those of the blended sum. No allocation, lock or
/// exception.
Penetration blend_details(const PlacedTree& a, const PlacedTree& b, const RelativePose& pose,
                          const PenetrationSettings& settings, Workspace& workspace,
                          const BlendSums& sums) noexcept;

}  // namespace ist
