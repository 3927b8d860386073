#pragma once

#include <cuda_runtime_api.h>

#include "cuda/query/field_steps.h"
#include "cuda/query/triangle_kernels.h"

namespace ist::gpu {

/// Blocks that the current device runs at a time.
struct FieldGrids {
  int smooth;
  TriangleGrids facets, mesh;
};

FieldGrids field_grids();

/// Launches all that answers a batch; waits for nothing. `has`: groups of which there are fields.
void launch_field_batch(const FieldBatch& batch, const bool (&has)[kFieldGroups],
                        const FieldGrids& grids, cudaStream_t stream);

}  // namespace ist::gpu
