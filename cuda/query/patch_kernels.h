#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>

#include "cuda/query/patch_arrays.h"

namespace ist::gpu {

/// Blocks of the kernel that divides contacts that the current device runs at a time.
int patch_blocks();

/// Launches all that answers a batch; waits for nothing. `blocks`: patch_blocks(); as many work as
/// `room_bytes` hold the rooms of.
void launch_patches(const PatchArrays& batch, int blocks, std::size_t room_bytes,
                    cudaStream_t stream);

}  // namespace ist::gpu
