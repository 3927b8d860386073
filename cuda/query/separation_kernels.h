#pragma once

#include <cuda_runtime_api.h>

#include "cuda/query/separation_arrays.h"

namespace ist::gpu {

/// Blocks of each kernel that the current device runs at a time.
struct SeparationGrids {
  int search[2];  ///< in float, in double
};

SeparationGrids separation_grids();

/// Launches all that answers a batch; waits for nothing.
void launch_separations(const SeparationArrays& batch, const SeparationGrids& grids,
                        cudaStream_t stream);

}  // namespace ist::gpu
