#include "cuda/check.h"
#include "cuda/launch.h"
#include "cuda/query/by_warps.h"
#include "cuda/query/field_kernels.h"

namespace ist::gpu {
namespace {

constexpr unsigned kSiftThreads = 256;
constexpr unsigned kWarps = 3;  ///< whose memory is what a block may have
constexpr unsigned kThreads = 32 * kWarps;
/// Blocks on a multiprocessor: what registers allow. 168 a thread for those that meet triangles.
template <class Memory>
constexpr int kBlocksEach = 4;
template <>
constexpr int kBlocksEach<WalkMemory> = 6;

/// Places every pair and lists those that are not told at once.
__global__ void __launch_bounds__(kSiftThreads) sift_field_pairs(const FieldBatch batch) {
  const WarpTeam team;
  const std::uint64_t i = std::uint64_t{blockIdx.x} * kSiftThreads + threadIdx.x;
  const int group =
      i < batch.pairs.count ? sift_field_pair(batch, static_cast<std::uint32_t>(i)) : -1;
  for (int k = 0; k < kFieldGroups; ++k) {
    const std::uint32_t place = list_place(team, group == k, &batch.counters->listed[k]);
    if (group == k) listed_pair(batch, k, place) = static_cast<std::uint32_t>(i);
  }
}

template <class Memory>
constexpr FieldGroup kGroup = kSmooth;
template <>
constexpr FieldGroup kGroup<FacetMemory> = kFacets;
template <>
constexpr FieldGroup kGroup<SurfaceMemory> = kMesh;

template <class Memory>
__global__ void __launch_bounds__(kThreads, kBlocksEach<Memory>)
    sum_field_pairs(const FieldBatch batch) {
  __shared__ Memory memory[kWarps];
  FieldCounters& counters = *batch.counters;
  by_warps(load_fresh(&counters.listed[kGroup<Memory>]), &counters.taken[kGroup<Memory>],
           [&](const WarpTeam& team, std::uint32_t k) {
             sum_field_pair(team, batch, listed_pair(batch, kGroup<Memory>, k),
                            memory[threadIdx.x / 32]);
           });
}

template <class Memory>
void launch_sums(const FieldBatch& batch, const FieldGrids& grids, cudaStream_t stream) {
  sum_field_pairs<Memory>
      <<<static_cast<unsigned>(grids.sum[kGroup<Memory>]), kThreads, 0, stream>>>(batch);
  check_launch("summing trees in fields");
}

}  // namespace

FieldGrids field_grids() {
  FieldGrids grids = {};
  grids.sum[kSmooth] = blocks_at_a_time(sum_field_pairs<WalkMemory>, kThreads);
  grids.sum[kFacets] = blocks_at_a_time(sum_field_pairs<FacetMemory>, kThreads);
  grids.sum[kMesh] = blocks_at_a_time(sum_field_pairs<SurfaceMemory>, kThreads);
  return grids;
}

void launch_field_batch(const FieldBatch& batch, const FieldGrids& grids, cudaStream_t stream) {
  check(cudaMemsetAsync(batch.counters, 0, sizeof(FieldCounters), stream), "starting a batch");
  sift_field_pairs<<<blocks_for(batch.pairs.count, kSiftThreads), kSiftThreads, 0, stream>>>(batch);
  check_launch("placing trees in fields");
  launch_sums<WalkMemory>(batch, grids, stream);
  launch_sums<FacetMemory>(batch, grids, stream);
  launch_sums<SurfaceMemory>(batch, grids, stream);
}

}  // namespace ist::gpu
