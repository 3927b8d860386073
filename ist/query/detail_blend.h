#pragma once

#include <ist/query.h>

#include "query/relative_pose.h"

namespace ist {

/// The penetration under a pair budget: levels of detail blended by what they need (DetailChain),
/// with the gradients of the blended sum. Two assets without coarser levels have but one answer.
/// No allocation, lock or exception.
Penetration blend_details(const PlacedTree& a, const PlacedTree& b, const RelativePose& pose,
                          const QuerySettings& settings, Workspace& workspace) noexcept;

}  // namespace ist
