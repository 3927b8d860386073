#pragma once

#include <ist/query.h>
#include <ist/types.h>

namespace IST_API ist {

/// Runs batches on the calling task arena of oneTBB. Part of ist::ist: ist::query does
/// not link TBB.
ParallelFor tbb_parallel_for() noexcept;

}  // namespace ist
