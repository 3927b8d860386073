#pragma once

#include <cuda_runtime_api.h>

#include "cuda/query/batch_arrays.h"

namespace ist::gpu {

/// Blocks of each kernel that the current device runs at a time.
struct BatchGrids {
  int sum, details;
};

BatchGrids batch_grids();

/// Launches all that answers a batch; waits for nothing.
void launch_batch(const BatchArrays& batch, const BatchGrids& grids, cudaStream_t stream);

}  // namespace ist::gpu
