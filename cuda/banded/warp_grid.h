#pragma once

// Device code only.

#include <cstdint>

#include "cuda/banded/banded_kernel.h"
#include "cuda/banded/cooperative_grid.h"
#include "cuda/warp_team.h"

namespace ist::gpu {

/// The cooperative grid of a cooperative kernel (cooperative_grid.h): all its warps. Successive
/// numbers stand in different blocks, so that little work spreads over many multiprocessors.
template <class Scratch_>
class WarpCoopGrid {
 public:
  using Team = WarpTeam;
  using Lane = LaneTeam;
  using Scratch = Scratch_;

  /// `scratch`: shared memory, one a warp.
  __device__ WarpCoopGrid(GridBarrier* barrier, Scratch* scratch)
      : barrier_(barrier), scratch_(scratch + threadIdx.x / 32) {
    generation_ = atomic_load(&barrier->generation);
  }

  __device__ const Team& team() const { return team_; }
  __device__ Scratch& scratch() { return *scratch_; }
  __device__ std::uint32_t index() const { return threadIdx.x / 32 * gridDim.x + blockIdx.x; }
  __device__ std::uint32_t size() const { return blockDim.x / 32 * gridDim.x; }

  __device__ void pause() const { __nanosleep(100); }

  __device__ std::uint64_t now() const {
    std::uint64_t ns;
    asm volatile("mov.u64 %0, %%globaltimer;" : "=l"(ns));
    return ns;
  }

  template <class Last>
  __device__ void sync(const Last& last) {
    __syncthreads();
    if (threadIdx.x == 0) {
      __threadfence();
      if (atomicAdd(&barrier_->here, 1u) == gridDim.x - 1) {
        __threadfence();
        barrier_->here = 0;
        last();
        __threadfence();
        atomicExch(&barrier_->generation, generation_ + 1);
      } else {
        while (atomic_load(&barrier_->generation) == generation_) {
        }
        __threadfence();
      }
    }
    ++generation_;
    __syncthreads();
  }

 private:
  GridBarrier* barrier_;
  Scratch* scratch_;
  std::uint32_t generation_;
  Team team_;
};

}  // namespace ist::gpu
