#pragma once

// Device code only.

#include <cstddef>
#include <cstdint>

#include "cuda/base/atomics.h"
#include "cuda/base/check.h"
#include "cuda/base/warp_team.h"

namespace ist::gpu {

/// Storage for objects in shared memory, which runs no constructors.
template <class T, unsigned kCount>
struct Raw {
  alignas(alignof(T) > 16 ? alignof(T) : 16) std::byte bytes[kCount][sizeof(T)];
  __device__ T& operator[](unsigned warp) { return *reinterpret_cast<T*>(bytes[warp]); }
};

/// Calls work(team, k) for k < count while goes_on(). Each warp takes the next k when it is done
/// with one.
template <class Work, class GoesOn>
__device__ void by_warps(std::uint32_t count, std::uint32_t* taken, const Work& work,
                         const GoesOn& goes_on) {
  if (count == 0) return;  // no need for thousands of warps to query one counter
  const WarpTeam team;
  for (;;) {
    std::uint32_t k = count;
    if (team.lane() == 0 && goes_on()) k = atomic_add(taken, 1);
    k = team.broadcast(k, 0);
    if (k >= count) return;
    work(team, k);
  }
}
template <class Work>
__device__ void by_warps(std::uint32_t count, std::uint32_t* taken, const Work& work) {
  by_warps(count, taken, work, [] { return true; });
}

/// The number of blocks of a kernel that the current device runs at a time.
template <class Kernel>
int blocks_at_a_time(const Kernel& kernel, unsigned threads) {
  int device = 0, multiprocessors = 0, each = 0;
  check(cudaGetDevice(&device), "looking for a GPU");
  check(cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device),
        "querying the GPU's size");
  check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&each, kernel, static_cast<int>(threads), 0),
        "querying the occupancy of a kernel");
  return each * multiprocessors;
}

}  // namespace ist::gpu
