#pragma once

#include <cstdint>

#include <ist/gpu.h>

#include "cuda/query/batch_arrays.h"
#include "cuda/query/gap_descent.h"
#include "cuda/query/mesh_gap_arrays.h"

namespace ist::gpu {

/// A batch of separations, with its working memory.
struct SeparationArrays {
  BatchArrays pairs;  ///< solids, pairs, splits, tasks and their capacities
  // Pairs of spheres searched in float, others searched in double, and meshes.
  BatchCounters* counters;  ///< [3]
  std::uint32_t* list[3];   ///< each holds all pairs
  MeshGapArrays meshes;
  GpuSeparations answers;
  std::uint32_t max_visits;  ///< of a pair; ~0: no limit
  double max_distance;       ///< [u] 0: no limit
  GapTotals* totals;         ///< [split_capacity + task_capacity]
  GapEntries entries;
};

}  // namespace ist::gpu
