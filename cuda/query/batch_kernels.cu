#include "cuda/check.h"
#include "cuda/launch.h"
#include "cuda/query/batch_kernels.h"
#include "cuda/query/batch_steps.h"
#include "cuda/query/by_warps.h"
#include "cuda/query/detail_sums.h"
#include "cuda/warp_team.h"

namespace ist::gpu {
namespace {

constexpr unsigned kSiftThreads = 256;
constexpr unsigned kWarps = 4;
constexpr unsigned kThreads = 32 * kWarps;
constexpr std::uint32_t kHandOut = 4;  ///< pairs a warp, of a batch's last
constexpr int kBlocksEach = 5;         ///< a multiprocessor; more leave too few registers

/// Places every pair and lists those whose roots meet.
__global__ void __launch_bounds__(kSiftThreads) sift_pairs(const BatchArrays batch) {
  const WarpTeam team;
  const std::uint64_t i = std::uint64_t{blockIdx.x} * kSiftThreads + threadIdx.x;
  const PairUse use =
      i < batch.pairs.count ? sift_pair(batch, static_cast<std::uint32_t>(i)) : PairUse::answered;
  const std::uint32_t place = list_place(team, use == PairUse::summed, &batch.counters->listed);
  if (use == PairUse::summed) batch.list[place] = static_cast<std::uint32_t>(i);
  const std::uint32_t other = list_place(team, use == PairUse::detailed, &batch.counters->detailed);
  if (use == PairUse::detailed) batch.detailed[other] = static_cast<std::uint32_t>(i);
}

constexpr unsigned kDetailWarps = 2;

__global__ void __launch_bounds__(32 * kDetailWarps) sum_detailed_pairs(const BatchArrays batch) {
  __shared__ DetailMemory memory[kDetailWarps];
  BatchCounters& counters = *batch.counters;
  by_warps(load_fresh(&counters.detailed), &counters.details_taken,
           [&](const WarpTeam& team, std::uint32_t k) {
             sum_details(team, batch, batch.detailed[k], memory[threadIdx.x / 32]);
           });
}

__global__ void __launch_bounds__(kThreads, kBlocksEach) sum_pairs(const BatchArrays batch) {
  __shared__ PairMemory memory[kWarps];
  BatchCounters& counters = *batch.counters;
  // All warps stay busy until near the end: only what is taken last is handed out.
  const std::uint32_t listed = load_fresh(&counters.listed);
  const std::uint32_t last = kHandOut * kWarps * gridDim.x;
  by_warps(listed, &counters.taken, [&](const WarpTeam& team, std::uint32_t k) {
    sum_pair(team, batch, batch.list[k], k + last >= listed, memory[threadIdx.x / 32]);
  });
}

__global__ void __launch_bounds__(kThreads, kBlocksEach) sum_tasks(const BatchArrays batch) {
  __shared__ PairMemory memory[kWarps];
  BatchCounters& counters = *batch.counters;
  const std::uint32_t tasks = load_fresh(&counters.tasks);
  by_warps(tasks < batch.task_room ? tasks : batch.task_room, &counters.tasks_taken,
           [&](const WarpTeam& team, std::uint32_t k) {
             sum_task(team, batch, k, memory[threadIdx.x / 32]);
           });
}

}  // namespace

BatchGrids batch_grids() {
  return {blocks_at_a_time(sum_pairs, kThreads),
          blocks_at_a_time(sum_detailed_pairs, 32 * kDetailWarps)};
}

void launch_batch(const BatchArrays& batch, const BatchGrids& grids, cudaStream_t stream) {
  check(cudaMemsetAsync(batch.counters, 0, sizeof(BatchCounters), stream), "starting a batch");
  sift_pairs<<<blocks_for(batch.pairs.count, kSiftThreads), kSiftThreads, 0, stream>>>(batch);
  check_launch("placing pairs of trees");
  if (batch.measure == Measure::matched && batch.has_details) {
    sum_detailed_pairs<<<static_cast<unsigned>(grids.details), 32 * kDetailWarps, 0, stream>>>(
        batch);
    check_launch("summing pairs of trees at several levels of detail");
  }
  const auto blocks = static_cast<unsigned>(grids.sum);
  sum_pairs<<<blocks, kThreads, 0, stream>>>(batch);
  check_launch("summing pairs of trees");
  sum_tasks<<<blocks, kThreads, 0, stream>>>(batch);
  check_launch("summing what pairs left");
}

}  // namespace ist::gpu
