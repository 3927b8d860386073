#pragma once

#include <ist/query.h>

#include "query/base/relative_pose.h"

namespace ist {

/// The penetration from levels of detail. Under a pair budget they are blended by what they need
/// (DetailChain), and without one the finest answers; copies of one asset that all but coincide are
/// asked as unlike levels (CoincidenceWeight). The gradients are those of the blended sum. Two
/// assets without coarser levels have but one answer. No allocation, lock or exception.
Penetration blend_details(const PlacedTree& a, const PlacedTree& b, const RelativePose& pose,
                          const PenetrationSettings& settings, Workspace& workspace) noexcept;

}  // namespace ist
