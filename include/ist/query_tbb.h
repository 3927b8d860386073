#pragma once

#include <ist/query.h>

namespace ist {

/// Threads of the calling task arena of oneTBB for penetration_batch. Part of ist::ist: ist::query
/// does not link TBB.
ParallelFor tbb_parallel_for() noexcept;

}  // namespace ist
