#pragma once

#include <cstdint>

#include "base/team.h"

// Device code only.

namespace ist::gpu {

// The minimum, maximum and sum (modulo 2^32) of one integer from each of a warp's 32 threads, for
// all of them. Compute capability 8.0 has an instruction for it; older devices exchange values in
// five steps. Both give the same results, since the order does not matter for integers.

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

/// The 32 threads of a warp (base/team.h). All of them must be converged at every call.
struct WarpTeam {
  static constexpr int kWidth = 32;
  static constexpr unsigned kAll = kWholeWarp;

  __device__ int lane() const { return static_cast<int>(threadIdx.x & 31u); }
  static constexpr int kBatch = 1;

  __device__ void sync() const { __syncwarp(); }

  /// A team's memory is the block's.
  template <class T>
  __device__ T* memory(T* p) const {
    __builtin_assume(__isShared(p));
    return p;
  }

  __device__ std::uint32_t min(std::uint32_t value) const { return warp_min(value); }
  __device__ std::uint32_t max(std::uint32_t value) const { return warp_max(value); }
  __device__ int min(int value) const { return warp_min(value); }
  __device__ int max(int value) const { return warp_max(value); }
  __device__ float min(float value) const { return from_ordered_bits(min(ordered_bits(value))); }
  __device__ float max(float value) const { return from_ordered_bits(max(ordered_bits(value))); }
  __device__ std::uint64_t min(std::uint64_t value) const {
    // Reduces the high words, then the low words of the lanes with the least high word.
    const auto high = static_cast<std::uint32_t>(value >> 32);
    const auto low = static_cast<std::uint32_t>(value);
    const std::uint32_t least = min(high);
    return std::uint64_t{least} << 32 | min(high == least ? low : 0xFFFFFFFFu);
  }
  __device__ std::uint64_t max(std::uint64_t value) const { return ~min(~value); }
  __device__ double min(double value) const { return from_ordered_bits(min(ordered_bits(value))); }
  __device__ double max(double value) const { return from_ordered_bits(max(ordered_bits(value))); }

  __device__ int sum(int value) const {
    return static_cast<int>(warp_sum(static_cast<std::uint32_t>(value)));
  }
  /// Sums in a fixed order.
  __device__ double sum(double value) const {
    return warp_exchange(value, [](double a, double b) { return a + b; });
  }
  __device__ bool any(bool flag) const { return __any_sync(kAll, flag) != 0; }
  __device__ bool all(bool flag) const { return __all_sync(kAll, flag) != 0; }

  __device__ int exclusive_count(bool flag, int& total) const {
    const unsigned raised = __ballot_sync(kAll, flag);
    total = __popc(raised);
    return __popc(raised & ((1u << lane()) - 1u));
  }

  __device__ std::uint32_t ballot(bool flag) const { return __ballot_sync(kAll, flag); }

  __device__ std::uint32_t alike(std::uint32_t value) const {
    return __match_any_sync(kAll, value);
  }

  __device__ int first(bool flag, int& total) const {
    const unsigned raised = __ballot_sync(kAll, flag);
    total = __popc(raised);
    return __ffs(static_cast<int>(raised)) - 1;
  }

  template <class T>
  __device__ T broadcast(T value, int from) const {
    return __shfl_sync(kAll, value, from);
  }
};

/// A single thread of the device.
struct LaneTeam : SerialTeam {
  static constexpr int kBatch = 8;
};

}  // namespace ist::gpu
