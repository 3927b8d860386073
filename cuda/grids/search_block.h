#pragma once

// Device code only.

#include "cuda/warp_team.h"

namespace ist::gpu {

/// The warps of a block that search together for one prototype (packing/grids/nearest_primitive.h):
/// where there are few prototypes, this is what fills the card.
struct SearchBlock : WarpTeam {
  static constexpr unsigned kWarps = 8;
  static constexpr unsigned kThreads = 32 * kWarps;

  struct Memory {
    std::uint64_t found;
    std::uint32_t least;  ///< ordered bits of the least distance that any warp has seen
    std::uint32_t next;
  };
  Memory* memory = nullptr;  ///< shared by the block

  __device__ explicit SearchBlock(Memory* shared) : memory(shared) {}

  __device__ int part() const { return static_cast<int>(threadIdx.x / 32); }
  __device__ int parts() const { return static_cast<int>(kWarps); }

  __device__ void begin_search() const {
    __syncthreads();
    if (threadIdx.x == 0) {
      memory->found = ~std::uint64_t{0};
      memory->least = ~std::uint32_t{0};
    }
    __syncthreads();
  }

  /// A bound for the search, no worse than `mine`. How much better it is only time tells, and no
  /// result depends on it.
  __device__ float least_so_far(float mine) const {
    std::uint32_t least = ordered_bits(mine);
    if (lane() == 0) {
      const std::uint32_t before = atomicMin(&memory->least, least);
      least = before < least ? before : least;
    }
    return from_ordered_bits(broadcast(least, 0));
  }

  /// The least of all warps' values.
  __device__ std::uint64_t end_search(std::uint64_t mine) const {
    if (lane() == 0)
      atomicMin(reinterpret_cast<unsigned long long*>(&memory->found),
                static_cast<unsigned long long>(mine));
    __syncthreads();
    return memory->found;
  }
};

}  // namespace ist::gpu
