#pragma once

#include <ist/gpu.h>
#include <cstdint>

#include "cuda/query/batch_arrays.h"
#include "cuda/query/gap_descent.h"
#include "query/exact/mesh_gap.h"

namespace ist::gpu {

// The working memory of distances of a batch's meshes.

/// The results that one step of a pair of meshes hands to the next, A's unit frame.
struct MeshGapQuery {
  PairPlace place;
  double error;           ///< of the computed distance, against that of the solids
  double simplified;      ///< the share of that from the meshes' own error
  double reach;           ///< no coordinate is larger
  double most;            ///< larger distances need not be found
  double likely;          ///< an upper bound, unless a solid contains the other
  Vec3 toward;            ///< unit, from A to B near where they are nearest; or zero
  std::uint32_t pair;     ///< in the batch
  std::uint32_t swapped;  ///< 1: its A is the query's B
  std::uint32_t single;   ///< 1: boxes are measured in floats
  std::uint32_t visits, tests;
  std::uint32_t overlap;  ///< 1: triangles cross; 2: inner spheres meet
  std::uint32_t stopped;
  std::uint32_t in_double;  ///< in query k: the k-th query of the round with boxes in double
  std::uint32_t waiting;    ///< pairs of triangles that are to be measured
  std::uint32_t triangles[32][2];
  double left;  ///< squared lower bound of the pairs that a stopped search has left
  NearestTriangles best;
};

/// A round of pairs. Its steps are small kernels.
struct MeshGapRound {
  std::uint32_t count;                                  ///< of pairs
  std::uint32_t glanced, searched, measured, finished;  ///< of these pairs, taken so far
  std::uint32_t in_double, searched_in_double;
};

/// Pairs of assets that both keep their meshes.
struct MeshGapArrays {
  MeshGapRound* rounds;  ///< [2], in turn
  MeshGapQuery* queries;
  std::uint32_t query_capacity;
};

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
