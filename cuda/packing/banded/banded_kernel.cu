#include "cuda/packing/banded/banded_kernel.h"

#include <ist/types.h>

#include <cstdint>

#include "cuda/base/check.h"
#include "cuda/base/warp_team.h"
#include "cuda/packing/banded/banded_loop.h"
#include "packing/banded/wide_mesh_surface.h"

namespace ist::gpu {
namespace {

/// A cooperative kernel as a launch (banded_state.h): all its warps. Successive numbers belong to
/// different blocks, so that little work spreads over many multiprocessors.
template <class Scratch_>
class WarpCoopLaunch {
 public:
  using Team = WarpTeam;
  using Lane = LaneTeam;
  using Scratch = Scratch_;

  /// `scratch`: shared memory, one a warp.
  __device__ WarpCoopLaunch(CoopBarrier* barrier, Scratch* scratch)
      : barrier_(barrier), scratch_(scratch + threadIdx.x / 32) {
    generation_ = atomic_load(&barrier->generation);
  }

  __device__ const Team& team() const { return team_; }
  __device__ Scratch& scratch() { return *scratch_; }
  __device__ std::uint32_t index() const { return threadIdx.x / 32 * gridDim.x + blockIdx.x; }
  __device__ std::uint32_t size() const { return blockDim.x / 32 * gridDim.x; }

  __device__ void pause() const { __nanosleep(100); }

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
  CoopBarrier* barrier_;
  Scratch* scratch_;
  std::uint32_t generation_;
  Team team_;
};

using Scratch = packing::CellScratch<std::uint32_t>;

constexpr int kThreads = 512;                                       // a block
constexpr std::size_t kShared = sizeof(Scratch) * (kThreads / 32);  // bytes a block
static_assert(kShared <= 64 << 10, "what compute capability 7.5 gives a block");

__global__ void __launch_bounds__(kThreads, 1)
    banded_kernel(const BandedArrays arrays, const WideTree mesh, CoopBarrier* barrier) {
  extern __shared__ Scratch scratch[];
  WarpCoopLaunch<Scratch> coop(barrier, scratch);
  pack_banded(coop, arrays, packing::WideMeshSurface(mesh));
}

/// The number of blocks that can run at once, which a cooperative launch must not exceed. The
/// packing does not depend on it.
unsigned resident_blocks(const Queue& queue) {
  int each = 0;
  check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&each, banded_kernel, kThreads, kShared),
        "querying the occupancy of the packing kernel");
  if (each == 0)
    throw Error("GPU: the packing kernel does not fit this GPU's multiprocessors: bake on the CPU");
  return static_cast<unsigned>(each * queue.multiprocessors());
}

}  // namespace

void launch_banded(Queue& queue, const BandedArrays& arrays, const WideTree& mesh,
                   CoopBarrier* barrier) {
  check(cudaFuncSetAttribute(banded_kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                             static_cast<int>(kShared)),
        "preparing the packing kernel");
  cudaLaunchConfig_t config{};
  config.gridDim = dim3(resident_blocks(queue));
  config.blockDim = dim3(kThreads);
  config.dynamicSmemBytes = kShared;
  config.stream = queue.stream();
  cudaLaunchAttribute together{};
  together.id = cudaLaunchAttributeCooperative;
  together.val.cooperative = 1;
  config.attrs = &together;
  config.numAttrs = 1;
  check(cudaLaunchKernelEx(&config, banded_kernel, arrays, mesh, barrier),
        "starting the packing kernel");
}

}  // namespace ist::gpu
