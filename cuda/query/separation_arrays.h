#pragma once

#include <cstdint>

#include <ist/gpu.h>

#include "cuda/query/batch_arrays.h"
#include "cuda/query/gap_descent.h"

namespace ist::gpu {

/// A batch of separations in the memory of who works on it.
struct SeparationArrays {
  BatchArrays pairs;  ///< solids, pairs, splits, tasks and room for them
  // Of what is searched in float, and in double.
  BatchCounters* counters;  ///< [2]
  std::uint32_t* list[2];   ///< room for all pairs each
  GpuSeparations answers;
  std::uint32_t max_visits;  ///< of a pair; ~0: no limit
  GapTotals* totals;         ///< of splits[0]: [split_room + task_room]
  GapEntries entries;
};

}  // namespace ist::gpu
