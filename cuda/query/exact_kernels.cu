#include <algorithm>

#include "cuda/check.h"
#include "cuda/launch.h"
#include "cuda/query/by_warps.h"
#include "cuda/query/exact_steps.h"
#include "cuda/query/kernels.h"
#include "cuda/warp_team.h"

namespace ist::gpu {
namespace {

constexpr unsigned kSiftThreads = 128;
constexpr unsigned kWarps = 2;
constexpr unsigned kThreads = 32 * kWarps;
/// A multiprocessor, of the first pass; more leave too few registers.
constexpr int kBlocksEach = 8;

/// Places every pair and lists those whose boxes meet.
__global__ void __launch_bounds__(kSiftThreads) sift_meshes(const ExactArrays batch) {
  const WarpTeam team;
  const std::uint64_t i = std::uint64_t{blockIdx.x} * kSiftThreads + threadIdx.x;
  const bool asks = i < batch.pairs.count && sift_exact(batch, static_cast<std::uint32_t>(i));
  const std::uint32_t place = append(team, asks, &batch.counters->listed[0]);
  if (asks) batch.list[0][place] = static_cast<std::uint32_t>(i);
}

template <int kPass>
__global__ void __launch_bounds__(kThreads, kPass == 0 ? kBlocksEach : 4)
    cross_meshes(const ExactArrays batch) {
  // Shared memory runs no constructors.
  __shared__ alignas(16) std::byte bytes[kWarps][sizeof(ExactMemory)];
  const unsigned warp = threadIdx.x / 32;
  ExactMemory& memory = *reinterpret_cast<ExactMemory*>(bytes[warp]);
  const ExactRoom room = batch.room(kPass, blockIdx.x * kWarps + warp);
  ExactCounters& counters = *batch.counters;
  by_warps(load_fresh(&counters.listed[kPass]), &counters.taken[kPass],
           [&](const WarpTeam& team, std::uint32_t k) {
             ask_pass<kPass>(team, batch, k, room, memory);
           });
}

template <int kPass>
void launch_pass(const ExactArrays& batch, int most_blocks, cudaStream_t stream) {
  const std::size_t each = batch.bytes_of_team(kPass);
  const std::size_t fit = batch.room_bytes / (kWarps * each);
  const auto blocks =
      static_cast<unsigned>(std::clamp(fit, std::size_t{1}, static_cast<std::size_t>(most_blocks)));
  // Marks of blocks are zero between pairs.
  check(cudaMemset2DAsync(batch.rooms, each, 0, ExactRoom::fixed(batch.most_blocks),
                          std::size_t{kWarps} * blocks, stream),
        "readying a pass");
  cross_meshes<kPass><<<blocks, kThreads, 0, stream>>>(batch);
  check_launch("crossing meshes");
}

}  // namespace

void find_exact_grids(Grids& grids) {
  grids.exact[0] = blocks_at_a_time(cross_meshes<0>, kThreads);
  grids.exact[1] = blocks_at_a_time(cross_meshes<1>, kThreads);
  grids.exact[2] = blocks_at_a_time(cross_meshes<2>, kThreads);
}

std::size_t least_exact_bytes(std::uint32_t most_blocks) {
  return kWarps * (ExactRoom::fixed(most_blocks) + exact_room(kExactPasses - 1));
}

void launch_exact(const ExactArrays& batch, const Grids& grids, cudaStream_t stream) {
  check(cudaMemsetAsync(batch.counters, 0, sizeof(ExactCounters), stream), "starting a batch");
  sift_meshes<<<blocks_for(batch.pairs.count, kSiftThreads), kSiftThreads, 0, stream>>>(batch);
  check_launch("placing pairs of meshes");
  launch_pass<0>(batch, grids.exact[0], stream);
  launch_pass<1>(batch, grids.exact[1], stream);
  launch_pass<2>(batch, grids.exact[2], stream);
}

}  // namespace ist::gpu
