#include "cuda/check.h"
#include "cuda/launch.h"
#include "cuda/query/batch_kernels.h"
#include "cuda/query/batch_steps.h"
#include "cuda/query/by_warps.h"
#include "cuda/query/detail_sums.h"

namespace ist::gpu {
namespace {

constexpr unsigned kSiftThreads = 256;
constexpr unsigned kWarps = 4;
constexpr unsigned kThreads = 32 * kWarps;
constexpr int kBlocksEach = 5;  ///< a multiprocessor; more leave too few registers

/// Places every pair and lists those whose roots meet.
__global__ void __launch_bounds__(kSiftThreads) sift_pairs(const BatchArrays batch) {
  const WarpTeam team;
  const std::uint64_t i = std::uint64_t{blockIdx.x} * kSiftThreads + threadIdx.x;
  const int list = i < batch.pairs.count ? sift_pair(batch, static_cast<std::uint32_t>(i)) : -1;
  for (int kind = 0; kind < 2; ++kind) {
    const std::uint32_t place = list_place(team, list == kind, &batch.counters->listed[kind]);
    if (list == kind) batch.list[kind][place] = static_cast<std::uint32_t>(i);
  }
  const std::uint32_t place = list_place(team, list == kDetailed, &batch.counters->detailed);
  if (list == kDetailed) detailed_pair(batch, place) = static_cast<std::uint32_t>(i);
}

constexpr unsigned kDetailWarps = 2;

__global__ void __launch_bounds__(32 * kDetailWarps) sum_detailed_pairs(const BatchArrays batch) {
  __shared__ DetailMemory memory[kDetailWarps];
  BatchCounters& counters = *batch.counters;
  by_warps(load_fresh(&counters.detailed), &counters.details_taken,
           [&](const WarpTeam& team, std::uint32_t k) {
             sum_details(team, batch, detailed_pair(batch, k), memory[threadIdx.x / 32]);
           });
}

template <class Real>
constexpr int kKind = sizeof(Real) == 4 ? 0 : 1;

template <class Real>
__global__ void __launch_bounds__(kThreads, sizeof(Real) == 4 ? kBlocksEach : 1)
    sum_pairs(const BatchArrays batch) {
  __shared__ PairMemory<Real> memory[kWarps];
  BatchCounters& counters = *batch.counters;
  by_warps(load_fresh(&counters.listed[kKind<Real>]), &counters.taken[kKind<Real>],
           [&](const WarpTeam& team, std::uint32_t k) {
             sum_pair<WarpTeam, Real>(team, batch, batch.list[kKind<Real>][k],
                                      memory[threadIdx.x / 32]);
           });
}

template <class Real>
__global__ void __launch_bounds__(kThreads, sizeof(Real) == 4 ? kBlocksEach : 1)
    sum_tasks(const BatchArrays batch) {
  __shared__ PairMemory<Real> memory[kWarps];
  BatchCounters& counters = *batch.counters;
  const std::uint32_t tasks = load_fresh(&counters.tasks[kKind<Real>]);
  by_warps(tasks < batch.task_room ? tasks : batch.task_room, &counters.tasks_taken[kKind<Real>],
           [&](const WarpTeam& team, std::uint32_t k) {
             sum_task<WarpTeam, Real>(team, batch, k, memory[threadIdx.x / 32]);
           });
}

template <class Kernel>
int blocks_at_a_time(const Kernel& kernel, unsigned threads, int multiprocessors) {
  int each = 0;
  check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&each, kernel, static_cast<int>(threads), 0),
        "asking how many blocks run at a time");
  return each * multiprocessors;
}

template <class Real>
void launch_sums(const BatchArrays& batch, int blocks, cudaStream_t stream) {
  sum_pairs<Real><<<static_cast<unsigned>(blocks), kThreads, 0, stream>>>(batch);
  check_launch("summing pairs of trees");
  sum_tasks<Real><<<static_cast<unsigned>(blocks), kThreads, 0, stream>>>(batch);
  check_launch("summing what pairs left");
}

}  // namespace

BatchGrids batch_grids() {
  int device = 0, multiprocessors = 0;
  check(cudaGetDevice(&device), "looking for a GPU");
  check(cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device),
        "asking the GPU for its size");
  return {{blocks_at_a_time(sum_pairs<float>, kThreads, multiprocessors),
           blocks_at_a_time(sum_pairs<double>, kThreads, multiprocessors)},
          blocks_at_a_time(sum_detailed_pairs, 32 * kDetailWarps, multiprocessors)};
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
  launch_sums<float>(batch, grids.sum[0], stream);
  launch_sums<double>(batch, grids.sum[1], stream);
}

}  // namespace ist::gpu
