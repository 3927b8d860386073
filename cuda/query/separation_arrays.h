#pragma once

#include <cstdint>

#include <ist/gpu.h>

#include "cuda/query/batch_arrays.h"
#include "cuda/query/gap_descent.h"
#include "cuda/query/mesh_gap_arrays.h"

namespace ist::gpu {

/// A batch of separations in the memory of who works on it.
struct SeparationArrays {
  BatchArrays pairs;  ///< solids, pairs, splits, tasks and room for them
  // Of spheres that are searched in float, of others in double, and of meshes.
  BatchCounters* counters;  ///< [3]
  std::uint32_t* list[3];   ///< room for all pairs each
  MeshGapArrays meshes;
  GpuSeparations answers;
  std::uint32_t max_visits;  ///< of a pair; ~0: no limit
  double max_distance;       ///< [u] 0: no limit
  GapTotals* totals;         ///< of splits[0]: [split_room + task_room]
  GapEntries entries;
};

}  // namespace ist::gpu
