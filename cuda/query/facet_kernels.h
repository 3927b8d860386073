#pragma once

#include <cuda_runtime_api.h>

#include "cuda/query/facet_steps.h"

namespace ist::gpu {

/// Blocks that the current device runs at a time.
struct FacetGrids {
  int walk, sum, rest;
};

template <class Kind>
FacetGrids facet_grids();

/// Launches all that answers the pairs of a kind that a batch has listed.
template <class Kind>
void launch_facets(const FieldBatch& batch, const FacetGrids& grids, cudaStream_t stream);

}  // namespace ist::gpu
