#pragma once

// Device code only.

#include <cstdint>

namespace ist::gpu {

// The least, the largest and the sum (modulo 2^32) of the integers that the 32 threads of a warp
// hold, for each of them. Compute capability 8.0 has an instruction for it; before that they are
// exchanged in five steps. The order does not matter to integers: both give the same.

constexpr unsigned kWholeWarp = 0xFFFFFFFFu;

template <class Integer, class Merge>
__device__ Integer warp_exchange(Integer value, const Merge& merge) {
  for (int apart = 16; apart > 0; apart /= 2)
    value = merge(value, __shfl_xor_sync(kWholeWarp, value, apart));
  return value;
}

template <class Integer>
__device__ Integer warp_min(Integer value) {
#if __CUDA_ARCH__ >= 800
  return __reduce_min_sync(kWholeWarp, value);
#else
  return warp_exchange(value, [](Integer a, Integer b) { return a < b ? a : b; });
#endif
}

template <class Integer>
__device__ Integer warp_max(Integer value) {
#if __CUDA_ARCH__ >= 800
  return __reduce_max_sync(kWholeWarp, value);
#else
  return warp_exchange(value, [](Integer a, Integer b) { return a < b ? b : a; });
#endif
}

__device__ inline std::uint32_t warp_sum(std::uint32_t value) {
#if __CUDA_ARCH__ >= 800
  return __reduce_add_sync(kWholeWarp, value);
#else
  return warp_exchange(value, [](std::uint32_t a, std::uint32_t b) { return a + b; });
#endif
}

}  // namespace ist::gpu
