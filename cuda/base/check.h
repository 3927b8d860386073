#pragma once

#include <cuda_runtime_api.h>

namespace ist::gpu {

/// Throws Error unless `status` is success: the action, CUDA's message, and advice.
void check(cudaError_t status, const char* doing);

/// Throws Error, with the remedy, if gpu_available(device) is false.
void check_gpu(int device);

/// Throws Error if the last kernel could not be launched.
inline void check_launch(const char* kernel) { check(cudaGetLastError(), kernel); }

}  // namespace ist::gpu
