#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>

#include "cuda/query/broad_arrays.h"

namespace ist::gpu {

/// The memory that sorting takes [bytes].
std::size_t broad_scratch_bytes(const BroadArrays& scene);
/// Sets the constant indices.
void ready_broad(const BroadArrays& scene, cudaStream_t stream);
/// Launches one step.
void launch_broad(const BroadArrays& scene, cudaStream_t stream);

}  // namespace ist::gpu
