#include "cuda/base/check.h"
#include "cuda/base/launch.h"
#include "cuda/query/by_warps.h"
#include "cuda/query/kernels.h"

namespace ist::gpu {
namespace {

constexpr unsigned kThreadsEach = 128;  ///< of kernels with one thread per pair
constexpr unsigned kWarps = 4;          ///< whose memory is what a block may have
constexpr unsigned kThreads = 32 * kWarps;
constexpr int kBlocksEach = 4;  ///< on a multiprocessor: what registers allow, 128 a thread
constexpr unsigned kWholeWarps = 3;
constexpr unsigned kWholeThreads = 32 * kWholeWarps;
constexpr int kWholeBlocksEach = 4;  ///< 168 a thread

/// Begins round n.
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

/// Pairs that did not fit in their round, and those after the last of `n` rounds.
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

}  // namespace

TriangleGrids triangle_grids() {
  return {blocks_at_a_time(walk_queries, kThreads), blocks_at_a_time(sum_parts, kThreads),
          blocks_at_a_time(sum_the_rest, kWholeThreads)};
}

void launch_triangle_pairs(const FieldBatch& batch, const TriangleGrids& grids,
                           cudaStream_t stream) {
  constexpr std::uint64_t kLeastOfRound = 1 << 14;  // pairs that store some 700 words each
  const auto rounds =
      static_cast<std::uint32_t>((batch.pairs.count + kLeastOfRound - 1) / kLeastOfRound);
  const std::uint64_t most = batch.work.query_capacity;
  const unsigned blocks =
      blocks_for(batch.pairs.count < most ? batch.pairs.count : most, kThreadsEach);
  for (std::uint32_t n = 0; n < rounds; ++n) {
    place_queries<<<blocks, kThreadsEach, 0, stream>>>(batch, n);
    check_launch("placing trees among triangles");
    walk_queries<<<static_cast<unsigned>(grids.walk), kThreads, 0, stream>>>(batch, n);
    check_launch("finding triangles that meet trees");
    sum_parts<<<static_cast<unsigned>(grids.sum), kThreads, 0, stream>>>(batch, n);
    check_launch("summing trees among triangles");
    answer_queries<<<blocks, kThreadsEach, 0, stream>>>(batch, n);
    check_launch("answering trees among triangles");
  }
  sum_the_rest<<<static_cast<unsigned>(grids.rest), kWholeThreads, 0, stream>>>(batch, rounds);
  check_launch("summing what is left among triangles");
}

}  // namespace ist::gpu
