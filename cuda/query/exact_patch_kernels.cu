#include <algorithm>

#include "cuda/base/check.h"
#include "cuda/base/warp_team.h"
#include "cuda/query/by_warps.h"
#include "cuda/query/exact_patches.h"
#include "cuda/query/kernels.h"

namespace ist::gpu {
namespace {

constexpr unsigned kThreadsEach = 128;  ///< of kernels with one thread per pair
constexpr unsigned kWarps = 2;
constexpr unsigned kThreads = 32 * kWarps;
constexpr int kBlocksEach = 4;  ///< a multiprocessor; more leave too few registers

/// Lists the pairs whose boxes intersect.
__global__ void __launch_bounds__(kThreadsEach)
    sift_patches_of_meshes(const ExactPatchArrays batch) {
  const WarpTeam team;
  const std::uint64_t i = std::uint64_t{blockIdx.x} * kThreadsEach + threadIdx.x;
  const bool asks =
      i < batch.pairs.count && sift_exact_patches(batch, static_cast<std::uint32_t>(i));
  const std::uint32_t place = append(team, asks, &batch.counters->listed[kFirstPatchPass]);
  if (asks) batch.list[kFirstPatchPass][place] = static_cast<std::uint32_t>(i);
}

__global__ void __launch_bounds__(kThreads, kBlocksEach)
    divide_meshes(const ExactPatchArrays batch, const int pass) {
  __shared__ Raw<ExactWholeMemory, kWarps> memory;
  const unsigned warp = threadIdx.x / 32, team = blockIdx.x * kWarps + warp;
  const ExactWorkspace work = batch.workspace(pass, team);
  const Arena parts = batch.arena(pass, team);
  const std::uint32_t count = load_fresh(&batch.counters->listed[pass]);
  if (count > 0) clear_marks(WarpTeam(), work);
  by_warps(count, &batch.counters->taken[pass], [&](const WarpTeam& of, std::uint32_t k) {
    patch_pass(of, batch, pass, k, work, parts, memory[warp]);
  });
}

}  // namespace

void find_exact_patch_grids(Grids& grids) {
  grids.divide_meshes = blocks_at_a_time(divide_meshes, kThreads);
}

bool has_memory(const ExactPatchArrays& batch) {
  return kWarps * batch.bytes_of_team(kExactPasses - 1) <= batch.bytes;
}

void launch_exact_patches(const ExactPatchArrays& batch, const Grids& grids, cudaStream_t stream) {
  check(cudaMemsetAsync(batch.counters, 0, sizeof(ExactCounters), stream), "starting a batch");
  launch("sifting pairs of meshes", sift_patches_of_meshes,
         blocks_for(batch.pairs.count, kThreadsEach), kThreadsEach, stream, batch);
  for (int pass = kFirstPatchPass; pass < kExactPasses; ++pass) {
    const std::size_t fit = batch.bytes / (kWarps * batch.bytes_of_team(pass));
    const auto most = static_cast<std::size_t>(std::min(
        blocks_for(batch.pairs.count, kWarps), static_cast<unsigned>(grids.divide_meshes)));
    launch("dividing contacts of meshes into patches", divide_meshes,
           std::clamp(fit, std::size_t{1}, most), kThreads, stream, batch, pass);
  }
}

}  // namespace ist::gpu
