#pragma once

#include <ist/query.h>

#include "query/base/relative_pose.h"
#include "query/kernel/overlap.h"

namespace ist {

/// An overlap in world units, its volume limited to the bounds on it, A's unit frame.
Penetration world_answer(const Overlap& overlap, double lowest, double highest,
                         const RelativePose& pose) noexcept;

/// A stopped answer with no more than the volume `most` [u³]: its estimate may be far more. The
/// push shrinks with the volume.
Penetration kept_within(double most, Penetration answer) noexcept;

}  // namespace ist
