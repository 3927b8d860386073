#include "cuda/check.h"
#include "cuda/launch.h"
#include "cuda/query/by_warps.h"
#include "cuda/query/kernels.h"

namespace ist::gpu {
namespace {

constexpr unsigned kThreadsEach = 128;  ///< of what one thread does of a pair
constexpr unsigned kWarps = 4;          ///< whose memory is what a block may have
constexpr unsigned kThreads = 32 * kWarps;
constexpr int kBlocksEach = 4;  ///< on a multiprocessor: what registers allow, 128 a thread
constexpr unsigned kWholeWarps = 3;
constexpr unsigned kWholeThreads = 32 * kWholeWarps;
constexpr int kWholeBlocksEach = 4;  ///< 168 a thread

/// Begins the n-th round.
template <class Kind>
__global__ void __launch_bounds__(kThreadsEach)
    place_queries(const FieldBatch batch, const std::uint32_t n) {
  const std::uint32_t first = end_of<Kind>(batch, round_of<Kind>(batch, n + 1));
  const std::uint32_t k = blockIdx.x * kThreadsEach + threadIdx.x;
  if (k == 0) round_of<Kind>(batch, n) = {first, 0, 0, 0, 0};
  if (k < pairs_from<Kind>(batch, first)) place_query<Kind>(batch, k, first + k);
}

template <class Kind>
__global__ void __launch_bounds__(kThreads, kBlocksEach)
    walk_queries(const FieldBatch batch, const std::uint32_t n) {
  __shared__ typename Kind::WalkMemory memory[kWarps];
  TriangleRound& round = round_of<Kind>(batch, n);
  by_warps(
      pairs_from<Kind>(batch, round.first), &round.walked,
      [&](const WarpTeam& team, std::uint32_t k) {
        walk_query<Kind>(team, batch, round, k, memory[threadIdx.x / 32]);
      },
      [&] { return goes_on(batch, round, gridDim.x * kWarps); });
}

template <class Kind>
__global__ void __launch_bounds__(kThreads, kBlocksEach)
    sum_parts(const FieldBatch batch, const std::uint32_t n) {
  __shared__ SumMemory<Kind> memory[kWarps];
  TriangleRound& round = round_of<Kind>(batch, n);
  const std::uint32_t room = batch.room.part_room;
  by_warps(round.parts < room ? round.parts : room, &round.summed,
           [&](const WarpTeam& team, std::uint32_t k) {
             sum_part<Kind>(team, batch, k, memory[threadIdx.x / 32]);
           });
}

template <class Kind>
__global__ void __launch_bounds__(kThreadsEach)
    answer_queries(const FieldBatch batch, const std::uint32_t n) {
  const std::uint32_t k = blockIdx.x * kThreadsEach + threadIdx.x;
  if (k < walked_of<Kind>(batch, round_of<Kind>(batch, n))) answer_query(batch, k);
}

/// Pairs that found no room in their round, and those after the last of `n` rounds.
template <class Kind>
__global__ void __launch_bounds__(kWholeThreads, kWholeBlocksEach)
    sum_the_rest(const FieldBatch batch, const std::uint32_t n) {
  __shared__ WholeMemory<Kind> memory[kWholeWarps];
  FieldCounters& counters = *batch.counters;
  const std::uint32_t large = counters.large[Kind::kGroup];
  const std::uint32_t first = end_of<Kind>(batch, round_of<Kind>(batch, n - 1));
  by_warps(large + (counters.listed[Kind::kGroup] - first), &counters.taken[Kind::kGroup],
           [&](const WarpTeam& team, std::uint32_t k) {
             const std::uint32_t at = k < large ? k : first + (k - large);
             sum_whole_query<Kind>(team, batch, listed_pair(batch, Kind::kGroup, at),
                                   memory[threadIdx.x / 32]);
           });
}

}  // namespace

template <class Kind>
TriangleGrids triangle_grids() {
  return {blocks_at_a_time(walk_queries<Kind>, kThreads),
          blocks_at_a_time(sum_parts<Kind>, kThreads),
          blocks_at_a_time(sum_the_rest<Kind>, kWholeThreads)};
}

template <class Kind>
void launch_triangle_pairs(const FieldBatch& batch, const Grids& all, cudaStream_t stream) {
  const TriangleGrids& grids = all.of[Kind::kGroup];
  constexpr std::uint64_t kLeastOfRound = 1 << 14;  // of pairs that keep some 700 words each
  const auto rounds =
      static_cast<std::uint32_t>((batch.pairs.count + kLeastOfRound - 1) / kLeastOfRound);
  const std::uint64_t most = batch.room.query_room;
  const unsigned blocks =
      blocks_for(batch.pairs.count < most ? batch.pairs.count : most, kThreadsEach);
  for (std::uint32_t n = 0; n < rounds; ++n) {
    place_queries<Kind><<<blocks, kThreadsEach, 0, stream>>>(batch, n);
    check_launch("placing trees among triangles");
    walk_queries<Kind><<<static_cast<unsigned>(grids.walk), kThreads, 0, stream>>>(batch, n);
    check_launch("finding triangles that meet trees");
    sum_parts<Kind><<<static_cast<unsigned>(grids.sum), kThreads, 0, stream>>>(batch, n);
    check_launch("summing trees among triangles");
    answer_queries<Kind><<<blocks, kThreadsEach, 0, stream>>>(batch, n);
    check_launch("answering trees among triangles");
  }
  sum_the_rest<Kind>
      <<<static_cast<unsigned>(grids.rest), kWholeThreads, 0, stream>>>(batch, rounds);
  check_launch("summing what is left among triangles");
}

template TriangleGrids triangle_grids<MeshKind>();
template TriangleGrids triangle_grids<FacetKind>();
template void launch_triangle_pairs<MeshKind>(const FieldBatch&, const Grids&, cudaStream_t);
template void launch_triangle_pairs<FacetKind>(const FieldBatch&, const Grids&, cudaStream_t);

}  // namespace ist::gpu
