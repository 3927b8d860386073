#include "cuda/banded/banded_kernel.h"

#include "cuda/banded/banded_loop.h"
#include "cuda/banded/warp_grid.h"
#include "cuda/check.h"
#include "packing/banded/wide_mesh_surface.h"

namespace ist::gpu {
namespace {

using Scratch = packing::CellScratch<std::uint32_t>;

constexpr int kThreads = 512;  // a block; one block a multiprocessor

__global__ void __launch_bounds__(kThreads, 1)
    banded_kernel(const BandedArrays arrays, const WideTree mesh, GridBarrier* place) {
  extern __shared__ Scratch scratch[];
  WarpCoopGrid<Scratch> coop(place, scratch);
  pack_banded(coop, arrays, packing::WideMeshSurface(mesh));
}

}  // namespace

void launch_banded(Queue& queue, const BandedArrays& arrays, const WideTree& mesh,
                   GridBarrier* place) {
  constexpr std::size_t kShared = sizeof(Scratch) * (kThreads / 32);
  check(cudaFuncSetAttribute(banded_kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                             static_cast<int>(kShared)),
        "preparing the packing kernel");
  cudaLaunchConfig_t config{};
  config.gridDim = dim3(static_cast<unsigned>(queue.multiprocessors()));
  config.blockDim = dim3(kThreads);
  config.dynamicSmemBytes = kShared;
  config.stream = queue.stream();
  cudaLaunchAttribute together{};
  together.id = cudaLaunchAttributeCooperative;
  together.val.cooperative = 1;
  config.attrs = &together;
  config.numAttrs = 1;
  check(cudaLaunchKernelEx(&config, banded_kernel, arrays, mesh, place),
        "starting the packing kernel");
}

}  // namespace ist::gpu
