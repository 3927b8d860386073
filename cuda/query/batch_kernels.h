#pragma once

#include <cuda_runtime_api.h>

#include "cuda/query/batch_arrays.h"

namespace ist::gpu {

/// Blocks of a kernel that the current device runs at a time.
int batch_blocks();

/// Launches all that answers a batch; waits for nothing.
void launch_batch(const BatchArrays& batch, int blocks_at_a_time, cudaStream_t stream);

}  // namespace ist::gpu
