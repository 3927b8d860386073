#pragma once

#include <cuda_runtime_api.h>

#include "cuda/query/triangle_steps.h"

namespace ist::gpu {

/// Blocks that the current device runs at a time.
struct TriangleGrids {
  int walk, sum, rest;
};

template <class Kind>
TriangleGrids triangle_grids();

/// Launches all that answers the pairs of a kind that a batch has listed.
template <class Kind>
void launch_triangle_pairs(const FieldBatch& batch, const TriangleGrids& grids,
                           cudaStream_t stream);

}  // namespace ist::gpu
