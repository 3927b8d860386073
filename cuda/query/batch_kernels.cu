#include "cuda/base/check.h"
#include "cuda/base/warp_team.h"
#include "cuda/query/batch_steps.h"
#include "cuda/query/by_warps.h"
#include "cuda/query/detail_sums.h"
#include "cuda/query/kernels.h"

namespace ist::gpu {
namespace {

constexpr unsigned kSiftThreads = 64;  ///< few pairs are placed by many multiprocessors
constexpr unsigned kWarps = 4;
constexpr unsigned kThreads = 32 * kWarps;
constexpr std::uint32_t kHandOut = 4;  ///< pairs a warp, of a batch's last
constexpr int kBlocksEach = 5;         ///< a multiprocessor; more leave too few registers

/// Places every pair and lists those whose roots meet.
__global__ void __launch_bounds__(kSiftThreads) sift_pairs(const BatchArrays batch) {
  const WarpTeam team;
  const std::uint64_t i = std::uint64_t{blockIdx.x} * kSiftThreads + threadIdx.x;
  std::uint32_t meet = 0;
  const PairUse use = i < batch.pairs.count ? sift_pair(batch, static_cast<std::uint32_t>(i), meet)
                                            : PairUse::answered;
  const std::uint32_t place = append(team, use == PairUse::summed, &batch.counters->listed);
  if (use == PairUse::summed) list_pair(batch, static_cast<std::uint32_t>(i), meet, place);
  const std::uint32_t other = append(team, use == PairUse::detailed, &batch.counters->detailed);
  if (use == PairUse::detailed) batch.detailed[other] = static_cast<std::uint32_t>(i);
}

constexpr unsigned kDetailWarps = 2;

__global__ void __launch_bounds__(32 * kDetailWarps) sum_detailed_pairs(const BatchArrays batch) {
  __shared__ DetailMemory memory[kDetailWarps];
  BatchCounters& counters = *batch.counters;
  const std::uint32_t detailed = load_fresh(&counters.detailed);
  if (detailed == 0) return;
  by_warps(detailed, &counters.details_taken, [&](const WarpTeam& team, std::uint32_t k) {
    sum_details(team, batch, batch.detailed[k], memory[threadIdx.x / 32]);
  });
}

/// Takes pairs from the list or, once it is empty, a task. Waits for a task as long as pairs in
/// progress may create some. Returns its position and the number taken. Called by a warp's first
/// lane.
__device__ std::uint32_t take(const BatchArrays& batch, std::uint32_t listed, std::uint32_t most,
                              bool& is_task, std::uint32_t& at) {
  BatchCounters& counters = *batch.counters;
  if (!is_task) {
    // Near the end pairs are taken one at a time so that all warps stay busy.
    const std::uint32_t taken = atomic_load(&counters.taken);
    const bool near_end = taken >= listed || listed - taken <= most;
    const std::uint32_t count = near_end ? 1 : 1 + kPlacedAhead;
    at = atomic_add(&counters.taken, count);
    if (at < listed) return count < listed - at ? count : listed - at;
    is_task = true;
  }
  at = atomic_add(&counters.tasks_taken, 1);
  for (;;) {
    const int found = look_for_task(batch, at, most);
    if (found >= 0) return static_cast<std::uint32_t>(found);
    __nanosleep(500);
  }
}

/// Sums pairs, and then the tasks that pairs have left, in one loop, so that the code of the
/// traversal exists once and stays in the instruction cache.
__global__ void __launch_bounds__(kThreads, kBlocksEach) sum_pairs(const BatchArrays batch) {
  __shared__ WorkMemory memories[kWarps];
  const WarpTeam team;
  WorkMemory& memory = memories[threadIdx.x / 32];
  const std::uint32_t listed = load_fresh(&batch.counters->listed);
  if (listed == 0) return;
  const std::uint32_t most = pairs_handed_out(listed, kHandOut * kWarps * gridDim.x);
  if (team.lane() == 0) {
    memory.is_task = false;
    memory.waiting = 0;
  }
  for (;;) {
    team.sync();
    if (memory.waiting > 0) {
      take_placed(team, memory);
    } else {
      std::uint32_t count = 0, at = 0;
      bool is_task = false;
      if (team.lane() == 0) {
        is_task = memory.is_task;
        count = take(batch, listed, most, is_task, at);
      }
      count = team.broadcast(count, 0);
      if (count == 0) return;
      at = team.broadcast(at, 0);
      is_task = team.any(is_task);
      if (team.lane() == 0) {
        memory.is_task = is_task;
        memory.at = at;
      }
      team.sync();
      if (!is_task)
        place_pairs(team, batch, at, count, memory);
      else if (!take_task(team, batch, memory))
        continue;
    }
    const bool hand_out = !memory.is_task && listed - memory.at <= most;
    if (team.lane() == 0) memory.hand_out = hand_out;
    do_work(team, batch, memory);
    // Its tasks are counted by now.
    if (team.lane() == 0 && hand_out) atomic_add(&batch.counters->handed_out, 1);
  }
}

}  // namespace

void find_batch_grids(Grids& grids) {
  grids.sum = blocks_at_a_time(sum_pairs, kThreads);
  grids.details = blocks_at_a_time(sum_detailed_pairs, 32 * kDetailWarps);
}

void launch_batch(const BatchArrays& batch, const Grids& grids, cudaStream_t stream) {
  check(cudaMemsetAsync(batch.counters, 0, sizeof(BatchCounters), stream), "starting a batch");
  launch("placing pairs of trees", sift_pairs, blocks_for(batch.pairs.count, kSiftThreads),
         kSiftThreads, stream, batch);
  if (batch.measure == Measure::matched && batch.has_details) {
    launch("summing pairs of trees at several levels of detail", sum_detailed_pairs, grids.details,
           32 * kDetailWarps, stream, batch);
  }
  // A small batch gets no more warps than can have work: warps that wait for tasks would block
  // other kernels.
  const std::uint64_t wanted =
      (batch.pairs.count * (1 + std::uint64_t{kTasksOfPair}) + kWarps - 1) / kWarps;
  const auto most = static_cast<std::uint64_t>(grids.sum);
  const auto blocks = static_cast<unsigned>(wanted < most ? wanted : most);
  launch("summing pairs of trees", sum_pairs, blocks, kThreads, stream, batch);
}

}  // namespace ist::gpu
