#include <algorithm>

#include "cuda/base/check.h"
#include "cuda/base/warp_team.h"
#include "cuda/query/by_warps.h"
#include "cuda/query/exact_kept.h"
#include "cuda/query/exact_steps.h"
#include "cuda/query/kernels.h"

namespace ist::gpu {
namespace {

constexpr unsigned kThreadsEach = 128;  ///< of kernels with one thread per pair
constexpr unsigned kWarps = 4;
constexpr unsigned kThreads = 32 * kWarps;
constexpr unsigned kWholeWarps = 2;  ///< of kernels whose warps need more memory
constexpr unsigned kWholeThreads = 32 * kWholeWarps;
// Blocks per multiprocessor; more would leave too few registers.
constexpr int kSearchBlocks = 6, kKeepBlocks = 5, kSumBlocks = 4, kExactBlocks = 2,
              kWholeBlocks = 4, kTouchBlocks = 5;

/// Lists the pairs for which sift(i) is true: those whose boxes intersect.
template <class Sift>
__device__ void sift_pairs(const ExactArrays& batch, const Sift& sift) {
  const WarpTeam team;
  const std::uint64_t i = std::uint64_t{blockIdx.x} * kThreadsEach + threadIdx.x;
  const bool asks = i < batch.pairs.count && sift(static_cast<std::uint32_t>(i));
  const std::uint32_t place = append(team, asks, &batch.counters->listed[0]);
  if (asks) batch.list[0][place] = static_cast<std::uint32_t>(i);
}
__global__ void __launch_bounds__(kThreadsEach) sift_meshes(const ExactArrays batch) {
  sift_pairs(batch, [&](std::uint32_t i) { return sift_exact(batch, i); });
}
__global__ void __launch_bounds__(kThreadsEach)
    sift_kept_meshes(const ExactArrays batch, const ExactKept kept) {
  sift_pairs(batch, [&](std::uint32_t i) { return sift_kept(batch, kept, i); });
}

/// Begins round n, and calls placed(k) for its pairs.
template <class Placed>
__device__ void place_round(const ExactArrays& batch, const std::uint32_t n, const Placed& placed) {
  const std::uint32_t first = end_of(round_of(batch, n + 1));
  const std::uint32_t k = blockIdx.x * kThreadsEach + threadIdx.x, count = pairs_from(batch, first);
  if (k == 0) round_of(batch, n) = {first, count, 0, 0, 0, 0, 0, 0, 0, 0};
  if (k >= count) return;
  place_query(batch, k, first + k);
  placed(k);
}
__global__ void __launch_bounds__(kThreadsEach)
    place_meshes(const ExactArrays batch, const std::uint32_t n) {
  place_round(batch, n, [](std::uint32_t) {});
}
__global__ void __launch_bounds__(kThreadsEach)
    place_kept_meshes(const ExactArrays batch, const ExactKept kept, const std::uint32_t n) {
  if (blockIdx.x == 0 && threadIdx.x == 0) kept.round(n + 1) = {};
  place_round(batch, n, [&](std::uint32_t k) { list_fresh(batch, kept, n, k); });
}

__global__ void __launch_bounds__(kThreads, kKeepBlocks)
    keep_meshes(const ExactArrays batch, const ExactKept kept, const std::uint32_t n) {
  __shared__ Raw<ExactAheadPair, kWarps> pair;
  __shared__ Raw<ExactSearchMemory, kWarps> memory;
  const unsigned warp = threadIdx.x / 32;
  KeptRound& round = kept.round(n);
  by_warps(round.fresh, &round.taken, [&](const WarpTeam& team, std::uint32_t k) {
    keep_query(team, batch, kept, kept.list[k], pair[warp], memory[warp]);
  });
}

/// Calls search(team, round, k, pair, memory) for a round's queries.
template <class Search>
__device__ void search_round(const ExactArrays& batch, const std::uint32_t n,
                             const Search& search) {
  __shared__ Raw<ExactPair, kWarps> pair;
  __shared__ Raw<ExactSearchMemory, kWarps> memory;
  const unsigned warp = threadIdx.x / 32;
  ExactRound& round = round_of(batch, n);
  std::uint32_t before = blockIdx.x * kWarps + warp;
  by_warps(
      round.count, &round.searched,
      [&](const WarpTeam& team, std::uint32_t k) {
        search(team, round, k, pair[warp], memory[warp]);
        before = 0;
      },
      [&] { return goes_on(batch, n, before); });
}
__global__ void __launch_bounds__(kThreads, kSearchBlocks)
    search_meshes(const ExactArrays batch, const std::uint32_t n) {
  search_round(
      batch, n,
      [&](const WarpTeam& team, ExactRound& round, std::uint32_t k, ExactPair& pair,
          ExactSearchMemory& memory) { search_query(team, batch, round, k, pair, memory); });
}
__global__ void __launch_bounds__(kThreads, kKeepBlocks)
    search_kept_meshes(const ExactArrays batch, const ExactKept kept, const std::uint32_t n) {
  search_round(batch, n,
               [&](const WarpTeam& team, ExactRound& round, std::uint32_t k, ExactPair& pair,
                   ExactSearchMemory& memory) {
                 search_kept_query(team, batch, kept, round, k, pair, memory);
               });
}

template <bool kExactly>
__global__ void __launch_bounds__(kThreads, kExactly ? kExactBlocks : kSumBlocks)
    sum_meshes(const ExactArrays batch, const std::uint32_t n) {
  __shared__ Raw<ExactPair, kWarps> pair;
  __shared__ Raw<ExactSumMemory, kWarps> memory;
  const unsigned warp = threadIdx.x / 32;
  ExactRound& round = round_of(batch, n);
  const ExactWorkspace work = batch.workspace(0, blockIdx.x * kWarps + warp);
  if (!kExactly && n == 0) clear_marks(WarpTeam(), work);
  if (kExactly && blockIdx.x == 0 && threadIdx.x == 0) batch.counters->exactly += round.unsure;
  by_warps(kExactly ? round.unsure : searched_of(round), kExactly ? &round.redone : &round.summed,
           [&](const WarpTeam& team, std::uint32_t k) {
             sum_query<kExactly>(team, batch, round, k, work, pair[warp], memory[warp]);
           });
}

__global__ void __launch_bounds__(kWholeThreads, kTouchBlocks)
    touch_meshes(const ExactArrays batch, const std::uint32_t n) {
  __shared__ Raw<ExactPair, kWholeWarps> pair;
  __shared__ Raw<ExactContactMemory, kWholeWarps> memory;
  const unsigned warp = threadIdx.x / 32;
  ExactRound& round = round_of(batch, n);
  by_warps(round.nothing, &round.touched, [&](const WarpTeam& team, std::uint32_t k) {
    touch_query(team, batch, k, pair[warp], memory[warp]);
  });
}

__global__ void __launch_bounds__(kWholeThreads, kWholeBlocks)
    ask_meshes(const ExactArrays batch, const int pass, const std::uint32_t rounds) {
  __shared__ Raw<ExactWholeMemory, kWholeWarps> memory;
  const unsigned warp = threadIdx.x / 32;
  const ExactWorkspace work = batch.workspace(pass, blockIdx.x * kWholeWarps + warp);
  const std::uint32_t listed = load_fresh(&batch.counters->listed[pass]);
  const std::uint32_t count = pairs_of_pass(batch, pass, rounds);
  if (count > 0) clear_marks(WarpTeam(), work);
  by_warps(count, &batch.counters->taken[pass], [&](const WarpTeam& team, std::uint32_t k) {
    ask_pass(team, batch, pass, rounds, listed, k, work, memory[warp]);
  });
}

/// The number of blocks of `warps` each for all pairs, at most `grid`.
unsigned blocks_of(const ExactArrays& batch, unsigned warps, int grid) {
  return std::min(blocks_for(batch.pairs.count, warps), static_cast<unsigned>(grid));
}
/// The same, limited to the teams of a pass that have memory.
unsigned blocks_with_memory(const ExactArrays& batch, int pass, std::size_t bytes, unsigned warps,
                            int grid) {
  const std::size_t all = bytes / (warps * batch.bytes_of_team(pass));
  return static_cast<unsigned>(
      std::clamp(all, std::size_t{1}, std::size_t{blocks_of(batch, warps, grid)}));
}

}  // namespace

void find_exact_grids(Grids& grids) {
  grids.exact = {
      blocks_at_a_time(search_meshes, kThreads),
      {blocks_at_a_time(keep_meshes, kThreads), blocks_at_a_time(search_kept_meshes, kThreads)},
      {blocks_at_a_time(sum_meshes<false>, kThreads), blocks_at_a_time(sum_meshes<true>, kThreads)},
      blocks_at_a_time(touch_meshes, kWholeThreads),
      blocks_at_a_time(ask_meshes, kWholeThreads)};
}

bool has_memory(const ExactArrays& batch) {
  const auto before = static_cast<std::size_t>(batch.team_memory - batch.memory);
  return before + kWarps * batch.bytes_of_team(0) <= batch.bytes &&
         kWholeWarps * batch.bytes_of_team(kExactPasses - 1) <= batch.bytes;
}

std::size_t exact_memory_bytes(const Grids& grids, std::size_t most_pairs) {
  constexpr std::size_t kUsualMesh = 8 << 10;
  const std::size_t teams = static_cast<std::size_t>(grids.exact.sum[0]) * kWarps;
  return (std::min(teams, most_pairs) + kWarps) * (exact_bytes(0) + kUsualMesh);
}

void launch_exact(const ExactArrays& batch, const ExactKept* kept, const Grids& grids,
                  cudaStream_t stream) {
  check(cudaMemsetAsync(batch.counters, 0, sizeof(ExactCounters), stream), "starting a batch");
  const unsigned all = blocks_for(batch.pairs.count, kThreadsEach);
  if (kept == nullptr) {
    launch("sifting pairs of meshes", sift_meshes, all, kThreadsEach, stream, batch);
  } else {
    check(cudaMemsetAsync(kept->rounds, 0, 2 * sizeof(KeptRound), stream), "starting a batch");
    launch("sifting pairs of meshes", sift_kept_meshes, all, kThreadsEach, stream, batch, *kept);
  }
  // Large batches have rounds of 8,192 pairs with some 30 chunks each, small ones rounds of a
  // quarter.
  constexpr std::uint64_t kLeast = 1 << 13, kFew = 1 << 11;
  const auto rounds = static_cast<std::uint32_t>(
      1 + batch.pairs.count / kLeast + std::min<std::uint64_t>(batch.pairs.count, 8 * kFew) / kFew);
  const unsigned blocks =
      blocks_for(std::min<std::uint64_t>(batch.pairs.count, batch.query_capacity), kThreadsEach);
  const unsigned sums = blocks_with_memory(
      batch, 0, batch.bytes - static_cast<std::size_t>(batch.team_memory - batch.memory), kWarps,
      grids.exact.sum[0]);
  for (std::uint32_t n = 0; n < rounds; ++n) {
    if (kept == nullptr) {
      launch("placing meshes", place_meshes, blocks, kThreadsEach, stream, batch, n);
      launch("searching meshes", search_meshes, blocks_of(batch, kWarps, grids.exact.search),
             kThreads, stream, batch, n);
    } else {
      launch("placing meshes", place_kept_meshes, blocks, kThreadsEach, stream, batch, *kept, n);
      launch("keeping triangles", keep_meshes, blocks_of(batch, kWarps, grids.exact.kept[0]),
             kThreads, stream, batch, *kept, n);
      launch("searching meshes", search_kept_meshes, blocks_of(batch, kWarps, grids.exact.kept[1]),
             kThreads, stream, batch, *kept, n);
    }
    launch("summing meshes", sum_meshes<false>, sums, kThreads, stream, batch, n);
    launch("summing meshes by exact signs", sum_meshes<true>,
           std::min(sums, static_cast<unsigned>(grids.exact.sum[1])), kThreads, stream, batch, n);
    launch("looking for faces that touch", touch_meshes,
           blocks_of(batch, kWholeWarps, grids.exact.touch), kWholeThreads, stream, batch, n);
  }
  for (int pass = 1; pass < kExactPasses; ++pass) {
    const unsigned whole =
        blocks_with_memory(batch, pass, batch.bytes, kWholeWarps, grids.exact.whole);
    launch("asking the pairs that need more memory", ask_meshes, whole, kWholeThreads, stream,
           batch, pass, rounds);
  }
}

}  // namespace ist::gpu
