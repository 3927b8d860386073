#include <algorithm>

#include "cuda/base/check.h"
#include "cuda/base/warp_team.h"
#include "cuda/query/by_warps.h"
#include "cuda/query/kernels.h"
#include "cuda/query/patch_steps.h"

namespace ist::gpu {
namespace {

constexpr unsigned kSiftThreads = 256;
constexpr unsigned kWarps = 2;
constexpr unsigned kThreads = 32 * kWarps;
constexpr int kBlocksEach = 8;  ///< a multiprocessor; there is no memory for more

/// Places every pair and lists those whose roots meet.
__global__ void __launch_bounds__(kSiftThreads) sift_contacts(const PatchArrays batch) {
  const WarpTeam team;
  const std::uint64_t i = std::uint64_t{blockIdx.x} * kSiftThreads + threadIdx.x;
  const bool sums =
      i < batch.pairs.pairs.count && sift_patches(batch, static_cast<std::uint32_t>(i));
  const std::uint32_t place = append(team, sums, &batch.pairs.counters->listed);
  if (sums) batch.pairs.list[place] = static_cast<std::uint32_t>(i);
}

__global__ void __launch_bounds__(kThreads, kBlocksEach) divide_contacts(const PatchArrays batch) {
  __shared__ PatchMemory memory[kWarps];
  const unsigned warp = threadIdx.x / 32;
  const PatchWorkspace work = batch.workspace(blockIdx.x * kWarps + warp);
  BatchCounters& counters = *batch.pairs.counters;
  by_warps(load_fresh(&counters.listed), &counters.taken,
           [&](const WarpTeam& team, std::uint32_t k) {
             patch_pair(team, batch, batch.pairs.list[k], work, memory[warp]);
           });
}

}  // namespace

void find_patch_grids(Grids& grids) { grids.divide = blocks_at_a_time(divide_contacts, kThreads); }

void launch_patches(const PatchArrays& batch, const Grids& grids, std::size_t memory_bytes,
                    cudaStream_t stream) {
  check(cudaMemsetAsync(batch.pairs.counters, 0, sizeof(BatchCounters), stream),
        "starting a batch");
  const std::size_t pairs = batch.pairs.pairs.count;
  launch("placing pairs of trees", sift_contacts, blocks_for(pairs, kSiftThreads), kSiftThreads,
         stream, batch);
  const std::size_t fit = memory_bytes / (kWarps * PatchWorkspace::bytes(batch.most_bins));
  const auto at_a_time =
      static_cast<unsigned>(std::min(fit, static_cast<std::size_t>(grids.divide)));
  launch("dividing contacts into patches", divide_contacts, at_a_time, kThreads, stream, batch);
}

}  // namespace ist::gpu
