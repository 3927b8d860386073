#pragma once

#include <cuda_runtime_api.h>
#include <algorithm>
#include <cstddef>
#include <type_traits>

namespace ist::gpu {

/// The number of blocks of `each` items for `items` items; at least one, since a grid must not be
/// empty.
inline unsigned blocks_for(std::size_t items, unsigned each) {
  return static_cast<unsigned>(std::max<std::size_t>((items + each - 1) / each, 1));
}

/// Throws Error unless `status` is success: the action, CUDA's message, and advice.
void check(cudaError_t status, const char* doing);

/// Throws Error, with the remedy, if gpu_available(device) is false.
void check_gpu(int device);

/// Throws Error if the last kernel could not be launched.
inline void check_launch(const char* kernel) { check(cudaGetLastError(), kernel); }

#ifdef __CUDACC__
/// Launches a kernel without shared memory of its own. Throws Error if that fails.
template <class Blocks, class... Parameters>
void launch(const char* doing, void (*kernel)(Parameters...), Blocks blocks, unsigned threads,
            cudaStream_t stream, std::type_identity_t<Parameters>... arguments) {
  kernel<<<static_cast<unsigned>(blocks), threads, 0, stream>>>(arguments...);
  check_launch(doing);
}
#endif

}  // namespace ist::gpu
