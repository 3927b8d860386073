#include "cuda/base/check.h"
#include "cuda/base/launch.h"
#include "cuda/query/by_warps.h"
#include "cuda/query/field_steps.h"
#include "cuda/query/kernels.h"

namespace ist::gpu {
namespace {

constexpr unsigned kSiftThreads = 256;
constexpr unsigned kWarps = 3;  ///< whose memory is what a block may have
constexpr unsigned kThreads = 32 * kWarps;
constexpr int kBlocksEach = 6;  ///< on a multiprocessor: what registers allow

/// Places every pair and lists those that need a sum.
__global__ void __launch_bounds__(kSiftThreads) sift_field_pairs(const FieldBatch batch) {
  const WarpTeam team;
  const std::uint64_t i = std::uint64_t{blockIdx.x} * kSiftThreads + threadIdx.x;
  const int group =
      i < batch.pairs.count ? sift_field_pair(batch, static_cast<std::uint32_t>(i)) : -1;
  for (int k = 0; k < kFieldGroups; ++k) {
    const std::uint32_t place = append(team, group == k, &batch.counters->listed[k]);
    if (group == k) listed_pair(batch, k, place) = static_cast<std::uint32_t>(i);
  }
}

__global__ void __launch_bounds__(kThreads, kBlocksEach) sum_smooth_pairs(const FieldBatch batch) {
  __shared__ WalkMemory memory[kWarps];
  FieldCounters& counters = *batch.counters;
  by_warps(load_fresh(&counters.listed[kSmooth]), &counters.taken[kSmooth],
           [&](const WarpTeam& team, std::uint32_t k) {
             sum_field_pair(team, batch, listed_pair(batch, kSmooth, k), memory[threadIdx.x / 32]);
           });
}

}  // namespace

void find_field_grids(Grids& grids) {
  grids.smooth = blocks_at_a_time(sum_smooth_pairs, kThreads);
  grids.facets = triangle_grids();
}

void launch_field_batch(const FieldBatch& batch, const bool (&has)[kFieldGroups],
                        const Grids& grids, cudaStream_t stream) {
  check(cudaMemsetAsync(batch.counters, 0, sizeof(FieldCounters), stream), "starting a batch");
  sift_field_pairs<<<blocks_for(batch.pairs.count, kSiftThreads), kSiftThreads, 0, stream>>>(batch);
  check_launch("placing trees in fields");
  if (has[kSmooth]) {
    sum_smooth_pairs<<<static_cast<unsigned>(grids.smooth), kThreads, 0, stream>>>(batch);
    check_launch("summing trees in fields");
  }
  if (has[kFacets]) launch_triangle_pairs(batch, grids.facets, stream);
}

}  // namespace ist::gpu
