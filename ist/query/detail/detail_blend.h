#pragma once

#include <ist/query.h>

#include "query/base/budget.h"
#include "query/base/relative_pose.h"
#include "query/detail/detail_chain.h"

namespace ist {

/// Sums a pair of levels in place of PairOverlap::by(): contact patches sort the pair that answers
/// for most into bins.
struct LevelSum {
  Penetration (*sum)(void* context, const DetailPair& pair, const DescentLimits& limits) noexcept;
  void* context;
};

/// The penetration from levels of detail. Under a pair budget they are blended by what they need
/// (DetailChain), and without one the finest answers; copies of one asset that all but coincide are
/// asked as unlike levels (CoincidenceWeight). The gradients are those of the blended sum. Two
/// assets without coarser levels have but one answer. No allocation, lock or exception.
///
/// `most`: sums the pair of levels of the largest weight, once; null: it is summed as the others.
Penetration blend_details(const PlacedTree& a, const PlacedTree& b, const RelativePose& pose,
                          const PenetrationSettings& settings, Workspace& workspace,
                          const LevelSum* most = nullptr) noexcept;

}  // namespace ist
