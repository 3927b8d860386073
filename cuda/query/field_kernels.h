#pragma once

#include <cuda_runtime_api.h>

#include "cuda/query/field_steps.h"

namespace ist::gpu {

/// Blocks that the current device runs at a time, by FieldGroup.
struct FieldGrids {
  int sum[kFieldGroups];
};

FieldGrids field_grids();

/// Launches all that answers a batch; waits for nothing.
void launch_field_batch(const FieldBatch& batch, const FieldGrids& grids, cudaStream_t stream);

}  // namespace ist::gpu
