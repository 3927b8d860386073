#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>

#include "cuda/query/broad_arrays.h"

namespace ist::gpu {

/// [bytes] that sorting takes.
std::size_t broad_scratch_bytes(const BroadArrays& scene);
/// Sets what does not change: indices.
void ready_broad(const BroadArrays& scene, cudaStream_t stream);
/// One step.
void launch_broad(const BroadArrays& scene, cudaStream_t stream);

}  // namespace ist::gpu
