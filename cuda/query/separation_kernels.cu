#include <algorithm>

#include "cuda/base/check.h"
#include "cuda/base/warp_team.h"
#include "cuda/query/by_warps.h"
#include "cuda/query/kernels.h"
#include "cuda/query/separation_steps.h"

namespace ist::gpu {
namespace {

constexpr unsigned kSiftThreads = 256;
template <class Real>
constexpr int kKind = sizeof(Real) == 4 ? 0 : 1;
/// Warps per block, limited by a block's shared memory.
template <class Real>
constexpr unsigned kWarps = sizeof(Real) == 4 ? 4 : 2;
template <class Real>
constexpr unsigned kThreads = 32 * kWarps<Real>;
/// Blocks per multiprocessor; more would leave too few registers.
template <class Real>
constexpr int kBlocksEach = 5;

constexpr unsigned kPlaceThreads = 128;
constexpr unsigned kMeshWarps = 4, kMeshThreads = 32 * kMeshWarps;
template <class Real>
constexpr unsigned kSearchWarps = sizeof(Real) == 4 ? 4 : 2;
template <class Real>
constexpr unsigned kSearchThreads = 32 * kSearchWarps<Real>;
template <class Real>
constexpr int kMeshBlocks = sizeof(Real) == 4 ? 4 : 2;
constexpr int kMeasureBlocks = 2, kFinishBlocks = 8;

/// Places every pair and lists the valid ones.
__global__ void __launch_bounds__(kSiftThreads) sift_separations(const SeparationArrays batch) {
  const std::uint64_t i = std::uint64_t{blockIdx.x} * kSiftThreads + threadIdx.x;
  const auto pair = static_cast<std::uint32_t>(i);
  const int list = i < batch.pairs.pairs.count ? sift_separation(batch, pair) : -1;
  const WarpTeam team;
  for (int kind = 0; kind < 3; ++kind) {
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
  by_warps(tasks < batch.pairs.task_capacity ? tasks : batch.pairs.task_capacity,
           &counters.tasks_taken, [&](const WarpTeam& team, std::uint32_t k) {
             separate_task<WarpTeam, Real>(team, batch, k, memory[threadIdx.x / 32]);
           });
}

__global__ void __launch_bounds__(kPlaceThreads)
    place_meshes(const SeparationArrays batch, const std::uint32_t n) {
  const std::uint32_t first = n * batch.meshes.query_capacity, listed = batch.counters[2].listed;
  const std::uint32_t left = first < listed ? listed - first : 0;
  const std::uint32_t count =
      left < batch.meshes.query_capacity ? left : batch.meshes.query_capacity;
  const std::uint32_t k = blockIdx.x * kPlaceThreads + threadIdx.x;
  MeshGapRound& round = round_of(batch.meshes, n);
  // This clears the next round's counters; those of this round are zero already and in use.
  if (k == 0) round_of(batch.meshes, n + 1) = {};
  if (k == 0) round.count = count;
  if (k < count) place_mesh_gap(batch, round, k, batch.list[2][first + k]);
}

__global__ void __launch_bounds__(kThreads<float>, kBlocksEach<float>)
    glance_at_meshes(const SeparationArrays batch, const std::uint32_t n) {
  __shared__ GapMemory<float> memory[kWarps<float>];
  MeshGapRound& round = round_of(batch.meshes, n);
  by_warps(round.count, &round.glanced, [&](const WarpTeam& team, std::uint32_t k) {
    glance_at_spheres(team, batch, k, memory[threadIdx.x / 32]);
  });
}

template <class Real>
__global__ void __launch_bounds__(kSearchThreads<Real>, kMeshBlocks<Real>)
    search_meshes(const SeparationArrays batch, const std::uint32_t n) {
  __shared__ Raw<MeshGapMemory<Real>, kSearchWarps<Real>> memory;
  MeshGapRound& round = round_of(batch.meshes, n);
  constexpr bool kSingle = sizeof(Real) == 4;
  by_warps(kSingle ? round.count : round.in_double,
           kSingle ? &round.searched : &round.searched_in_double,
           [&](const WarpTeam& team, std::uint32_t k) {
             search_mesh_gap<Real>(team, batch, kSingle ? k : batch.meshes.queries[k].in_double,
                                   memory[threadIdx.x / 32]);
           });
}

__global__ void __launch_bounds__(kMeshThreads, kMeasureBlocks)
    measure_meshes(const SeparationArrays batch, const std::uint32_t n) {
  __shared__ Raw<MeshGapPair, kMeshWarps> memory;
  MeshGapRound& round = round_of(batch.meshes, n);
  by_warps(round.count, &round.measured, [&](const WarpTeam& team, std::uint32_t k) {
    measure_mesh_gap(team, batch, k, memory[threadIdx.x / 32]);
  });
}

__global__ void __launch_bounds__(kMeshThreads, kFinishBlocks)
    finish_meshes(const SeparationArrays batch, const std::uint32_t n) {
  __shared__ InsideStack stack[kMeshWarps];
  MeshGapRound& round = round_of(batch.meshes, n);
  by_warps(round.count, &round.finished, [&](const WarpTeam& team, std::uint32_t k) {
    finish_mesh_gap(team, batch, k, stack[threadIdx.x / 32]);
  });
}

void launch_meshes(const SeparationArrays& batch, const Grids& grids, cudaStream_t stream) {
  const std::uint32_t capacity = batch.meshes.query_capacity;
  const auto count = static_cast<std::uint32_t>(batch.pairs.pairs.count);
  check(cudaMemsetAsync(batch.meshes.rounds, 0, 2 * sizeof(MeshGapRound), stream),
        "starting rounds");
  for (std::uint32_t n = 0; n < (count + capacity - 1) / capacity; ++n) {
    launch("placing meshes", place_meshes, blocks_for(std::min(count, capacity), kPlaceThreads),
           kPlaceThreads, stream, batch, n);
    launch("looking at spheres of meshes", glance_at_meshes, grids.mesh_gaps.glance,
           kThreads<float>, stream, batch, n);
    launch("searching distances of meshes", search_meshes<float>, grids.mesh_gaps.search[0],
           kSearchThreads<float>, stream, batch, n);
    launch("searching distances of meshes in double", search_meshes<double>,
           grids.mesh_gaps.search[1], kSearchThreads<double>, stream, batch, n);
    launch("measuring triangles of meshes", measure_meshes, grids.mesh_gaps.measure, kMeshThreads,
           stream, batch, n);
    launch("answering distances of meshes", finish_meshes, grids.mesh_gaps.finish, kMeshThreads,
           stream, batch, n);
  }
}

template <class Real>
void launch_searches(const SeparationArrays& batch, int blocks, cudaStream_t stream) {
  launch("separating pairs of trees", separate_pairs<Real>, blocks, kThreads<Real>, stream, batch);
  launch("separating what pairs left", separate_tasks<Real>, blocks, kThreads<Real>, stream, batch);
}

}  // namespace

void find_separation_grids(Grids& grids) {
  grids.search[0] = blocks_at_a_time(separate_pairs<float>, kThreads<float>);
  grids.search[1] = blocks_at_a_time(separate_pairs<double>, kThreads<double>);
  grids.mesh_gaps = {blocks_at_a_time(glance_at_meshes, kThreads<float>),
                     {blocks_at_a_time(search_meshes<float>, kSearchThreads<float>),
                      blocks_at_a_time(search_meshes<double>, kSearchThreads<double>)},
                     blocks_at_a_time(measure_meshes, kMeshThreads),
                     blocks_at_a_time(finish_meshes, kMeshThreads)};
}

void launch_separations(const SeparationArrays& batch, const Grids& grids, bool has_spheres,
                        bool has_meshes, cudaStream_t stream) {
  check(cudaMemsetAsync(batch.counters, 0, 3 * sizeof(BatchCounters), stream), "starting a batch");
  launch("placing pairs of trees", sift_separations,
         blocks_for(batch.pairs.pairs.count, kSiftThreads), kSiftThreads, stream, batch);
  if (has_spheres) {
    launch_searches<float>(batch, grids.search[0], stream);
    launch_searches<double>(batch, grids.search[1], stream);
  }
  if (has_meshes) launch_meshes(batch, grids, stream);
}

}  // namespace ist::gpu
