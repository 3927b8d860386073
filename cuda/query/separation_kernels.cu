#include "cuda/base/check.h"
#include "cuda/base/launch.h"
#include "cuda/base/warp_team.h"
#include "cuda/query/by_warps.h"
#include "cuda/query/kernels.h"
#include "cuda/query/separation_steps.h"

namespace ist::gpu {
namespace {

constexpr unsigned kSiftThreads = 256;
template <class Real>
constexpr int kKind = sizeof(Real) == 4 ? 0 : 1;
/// Warps of a block: what the memory of a block holds.
template <class Real>
constexpr unsigned kWarps = sizeof(Real) == 4 ? 4 : 2;
template <class Real>
constexpr unsigned kThreads = 32 * kWarps<Real>;
/// Blocks a multiprocessor; more leave too few registers.
template <class Real>
constexpr int kBlocksEach = 5;

/// Places every pair and lists those that can be.
__global__ void __launch_bounds__(kSiftThreads) sift_separations(const SeparationArrays batch) {
  const std::uint64_t i = std::uint64_t{blockIdx.x} * kSiftThreads + threadIdx.x;
  const auto pair = static_cast<std::uint32_t>(i);
  const int list = i < batch.pairs.pairs.count ? sift_separation(batch, pair) : -1;
  const WarpTeam team;
  for (int kind = 0; kind < 2; ++kind) {
    const std::uint32_t place = append(team, list == kind, &batch.counters[kind].listed);
    if (list == kind) batch.list[kind][place] = pair;
  }
}

template <class Real>
__global__ void __launch_bounds__(kThreads<Real>, kBlocksEach<Real>)
    separate_pairs(const SeparationArrays batch) {
  __shared__ GapMemory<Real> memory[kWarps<Real>];
  BatchCounters& counters = batch.counters[kKind<Real>];
  by_warps(load_fresh(&counters.listed), &counters.taken,
           [&](const WarpTeam& team, std::uint32_t k) {
             separate_pair<WarpTeam, Real>(team, batch, batch.list[kKind<Real>][k],
                                           memory[threadIdx.x / 32]);
           });
}

template <class Real>
__global__ void __launch_bounds__(kThreads<Real>, kBlocksEach<Real>)
    separate_tasks(const SeparationArrays batch) {
  __shared__ GapMemory<Real> memory[kWarps<Real>];
  BatchCounters& counters = batch.counters[kKind<Real>];
  const std::uint32_t tasks = load_fresh(&counters.tasks);
  by_warps(tasks < batch.pairs.task_room ? tasks : batch.pairs.task_room, &counters.tasks_taken,
           [&](const WarpTeam& team, std::uint32_t k) {
             separate_task<WarpTeam, Real>(team, batch, k, memory[threadIdx.x / 32]);
           });
}

template <class Real>
void launch_searches(const SeparationArrays& batch, int blocks, cudaStream_t stream) {
  separate_pairs<Real><<<static_cast<unsigned>(blocks), kThreads<Real>, 0, stream>>>(batch);
  check_launch("separating pairs of trees");
  separate_tasks<Real><<<static_cast<unsigned>(blocks), kThreads<Real>, 0, stream>>>(batch);
  check_launch("separating what pairs left");
}

}  // namespace

void find_separation_grids(Grids& grids) {
  grids.search[0] = blocks_at_a_time(separate_pairs<float>, kThreads<float>);
  grids.search[1] = blocks_at_a_time(separate_pairs<double>, kThreads<double>);
}

void launch_separations(const SeparationArrays& batch, const Grids& grids, cudaStream_t stream) {
  check(cudaMemsetAsync(batch.counters, 0, 2 * sizeof(BatchCounters), stream), "starting a batch");
  sift_separations<<<blocks_for(batch.pairs.pairs.count, kSiftThreads), kSiftThreads, 0, stream>>>(
      batch);
  check_launch("placing pairs of trees");
  launch_searches<float>(batch, grids.search[0], stream);
  launch_searches<double>(batch, grids.search[1], stream);
}

}  // namespace ist::gpu
