#include "cuda/base/check.h"
#include "cuda/base/warp_team.h"
#include "cuda/query/by_warps.h"
#include "cuda/query/field_steps.h"
#include "cuda/query/kernels.h"

namespace ist::gpu {
namespace {

constexpr unsigned kThreadsEach = 128;  ///< of kernels with one thread per pair
constexpr unsigned kWarps = 4;          ///< limited by a block's memory
constexpr unsigned kThreads = 32 * kWarps;
constexpr int kBlocksEach = 4;  ///< on a multiprocessor, limited by registers, 128 a thread
constexpr unsigned kWholeWarps = 3;
constexpr unsigned kWholeThreads = 32 * kWholeWarps;
constexpr int kWholeBlocksEach = 4;  ///< 168 a thread

__global__ void __launch_bounds__(kThreadsEach)
    place_queries(const FieldBatch batch, const std::uint32_t n) {
  const std::uint32_t first = end_of(batch, round_of(batch, n + 1));
  const std::uint32_t k = blockIdx.x * kThreadsEach + threadIdx.x;
  if (k == 0) round_of(batch, n) = {first, 0, 0, 0, 0};
  if (k < pairs_from(batch, first)) place_query(batch, k, first + k);
}

__global__ void __launch_bounds__(kThreads, kBlocksEach)
    walk_queries(const FieldBatch batch, const std::uint32_t n) {
  __shared__ FacetWalkMemory memory[kWarps];
  TriangleRound& round = round_of(batch, n);
  by_warps(
      pairs_from(batch, round.first), &round.walked,
      [&](const WarpTeam& team, std::uint32_t k) {
        walk_query(team, batch, round, k, memory[threadIdx.x / 32]);
      },
      [&] { return goes_on(batch, round, gridDim.x * kWarps); });
}

__global__ void __launch_bounds__(kThreads, kBlocksEach)
    sum_parts(const FieldBatch batch, const std::uint32_t n) {
  __shared__ FacetSumMemory memory[kWarps];
  TriangleRound& round = round_of(batch, n);
  const std::uint32_t capacity = batch.work.part_capacity;
  by_warps(round.parts < capacity ? round.parts : capacity, &round.summed,
           [&](const WarpTeam& team, std::uint32_t k) {
             sum_part(team, batch, k, memory[threadIdx.x / 32]);
           });
}

__global__ void __launch_bounds__(kThreadsEach)
    answer_queries(const FieldBatch batch, const std::uint32_t n) {
  const std::uint32_t k = blockIdx.x * kThreadsEach + threadIdx.x;
  if (k < walked_of(batch, round_of(batch, n))) answer_query(batch, k);
}

/// Sums pairs that did not fit in their round, and those after the last of `n` rounds.
__global__ void __launch_bounds__(kWholeThreads, kWholeBlocksEach)
    sum_the_rest(const FieldBatch batch, const std::uint32_t n) {
  __shared__ FacetWholeMemory memory[kWholeWarps];
  FieldCounters& counters = *batch.counters;
  const std::uint32_t large = counters.large;
  const std::uint32_t first = end_of(batch, round_of(batch, n - 1));
  by_warps(large + (counters.listed[kFacets] - first), &counters.taken[kFacets],
           [&](const WarpTeam& team, std::uint32_t k) {
             const std::uint32_t at = k < large ? k : first + (k - large);
             sum_whole_query(team, batch, listed_pair(batch, kFacets, at),
                             memory[threadIdx.x / 32]);
           });
}

constexpr unsigned kSiftThreads = 256;
constexpr unsigned kSmoothWarps = 3;  ///< limited by a block's memory
constexpr unsigned kSmoothThreads = 32 * kSmoothWarps;
constexpr int kSmoothBlocksEach = 6;  ///< on a multiprocessor, limited by registers

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

__global__ void __launch_bounds__(kSmoothThreads, kSmoothBlocksEach)
    sum_smooth_pairs(const FieldBatch batch) {
  __shared__ WalkMemory memory[kSmoothWarps];
  FieldCounters& counters = *batch.counters;
  by_warps(load_fresh(&counters.listed[kSmooth]), &counters.taken[kSmooth],
           [&](const WarpTeam& team, std::uint32_t k) {
             sum_field_pair(team, batch, listed_pair(batch, kSmooth, k), memory[threadIdx.x / 32]);
           });
}

/// Launches the listed pairs with boxes and terrains.
void launch_triangle_pairs(const FieldBatch& batch, const TriangleGrids& grids,
                           cudaStream_t stream) {
  constexpr std::uint64_t kLeastOfRound = 1 << 14;  // pairs that store some 700 words each
  const auto rounds =
      static_cast<std::uint32_t>((batch.pairs.count + kLeastOfRound - 1) / kLeastOfRound);
  const std::uint64_t most = batch.work.query_capacity;
  const unsigned blocks =
      blocks_for(batch.pairs.count < most ? batch.pairs.count : most, kThreadsEach);
  for (std::uint32_t n = 0; n < rounds; ++n) {
    launch("placing trees among triangles", place_queries, blocks, kThreadsEach, stream, batch, n);
    launch("finding triangles that meet trees", walk_queries, grids.walk, kThreads, stream, batch,
           n);
    launch("summing trees among triangles", sum_parts, grids.sum, kThreads, stream, batch, n);
    launch("answering trees among triangles", answer_queries, blocks, kThreadsEach, stream, batch,
           n);
  }
  launch("summing what is left among triangles", sum_the_rest, grids.rest, kWholeThreads, stream,
         batch, rounds);
}

}  // namespace

void find_field_grids(Grids& grids) {
  grids.smooth = blocks_at_a_time(sum_smooth_pairs, kSmoothThreads);
  grids.facets = {blocks_at_a_time(walk_queries, kThreads), blocks_at_a_time(sum_parts, kThreads),
                  blocks_at_a_time(sum_the_rest, kWholeThreads)};
}

void launch_field_batch(const FieldBatch& batch, const bool (&has)[kFieldGroups],
                        const Grids& grids, cudaStream_t stream) {
  check(cudaMemsetAsync(batch.counters, 0, sizeof(FieldCounters), stream), "starting a batch");
  launch("placing trees in fields", sift_field_pairs, blocks_for(batch.pairs.count, kSiftThreads),
         kSiftThreads, stream, batch);
  if (has[kSmooth]) {
    launch("summing trees in fields", sum_smooth_pairs, grids.smooth, kSmoothThreads, stream,
           batch);
  }
  if (has[kFacets]) launch_triangle_pairs(batch, grids.facets, stream);
}

}  // namespace ist::gpu
