#include "cuda/banded/banded_kernel.h"

#include <ist/error.h>

#include "cuda/banded/banded_loop.h"
#include "cuda/banded/warp_grid.h"
#include "cuda/check.h"
#include "packing/banded/wide_mesh_surface.h"

namespace ist::gpu {
namespace {

using Scratch = packing::CellScratch<std::uint32_t>;

constexpr int kThreads = 512;                                       // a block
constexpr std::size_t kShared = sizeof(Scratch) * (kThreads / 32);  // bytes a block
static_assert(kShared <= 64 << 10, "what compute capability 7.5 gives a block");

__global__ void __launch_bounds__(kThreads, 1)
    banded_kernel(const BandedArrays arrays, const WideTree mesh, GridBarrier* barrier) {
  extern __shared__ Scratch scratch[];
  WarpCoopGrid<Scratch> coop(barrier, scratch);
  pack_banded(coop, arrays, packing::WideMeshSurface(mesh));
}

/// How many blocks can run at once, which a cooperative launch must not exceed. What is packed does
/// not depend on it.
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
                   GridBarrier* barrier) {
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
