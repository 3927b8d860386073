#pragma once

// Device code only.

#include "cuda/warp_team.h"

namespace ist::gpu {

/// The threads of a block (numerics/team.h). All of them must make the same calls.
template <int kThreads>
class BlockTeam {
  static constexpr int kWarps = kThreads / 32;

 public:
  static constexpr int kWidth = kThreads;

  struct Shared {
    std::uint64_t words[kWarps];
  };

  __device__ explicit BlockTeam(Shared& shared) : shared_(shared) {}

  __device__ int lane() const { return static_cast<int>(threadIdx.x); }
  __device__ void sync() const { __syncthreads(); }

  __device__ std::uint64_t min(std::uint64_t value) const {
    exchange(warp_.min(value));
    std::uint64_t least = shared_.words[0];
    for (int w = 1; w < kWarps; ++w) least = shared_.words[w] < least ? shared_.words[w] : least;
    __syncthreads();
    return least;
  }
  __device__ std::uint32_t min(std::uint32_t value) const {
    return static_cast<std::uint32_t>(min(std::uint64_t{value}));
  }
  __device__ double min(double value) const { return from_ordered_bits(min(ordered_bits(value))); }

  __device__ int exclusive_count(bool flag, int& total) const {
    int in_warp = 0;
    const int before = warp_.exclusive_count(flag, in_warp);
    exchange(static_cast<std::uint64_t>(in_warp));
    int earlier = 0;
    total = 0;
    for (int w = 0; w < kWarps; ++w) {
      if (w == static_cast<int>(threadIdx.x / 32)) earlier = total;
      total += static_cast<int>(shared_.words[w]);
    }
    __syncthreads();
    return earlier + before;
  }

  /// The value that lane `from` holds.
  __device__ std::uint32_t broadcast(std::uint32_t value, int from) const {
    if (lane() == from) shared_.words[0] = value;
    __syncthreads();
    const auto result = static_cast<std::uint32_t>(shared_.words[0]);
    __syncthreads();
    return result;
  }

 private:
  /// Every warp's value into shared memory.
  __device__ void exchange(std::uint64_t value) const {
    if (threadIdx.x % 32 == 0) shared_.words[threadIdx.x / 32] = value;
    __syncthreads();
  }

  Shared& shared_;
  WarpTeam warp_;
};

}  // namespace ist::gpu
