#include "cuda/packing/grids/device_rounds.h"

#include <algorithm>

#include "cuda/base/atomics.h"
#include "cuda/base/check.h"
#include "cuda/base/warp_team.h"
#include "packing/grids/ascent.h"
#include "packing/grids/distance_grid.h"
#include "packing/grids/prototype_cells.h"

namespace ist::gpu {
namespace {

/// The warps of a block that search together for one prototype (packing/grids/nearest_primitive.h).
/// This fills the device if there are few prototypes.
struct SearchBlock : WarpTeam {
  static constexpr unsigned kWarps = 8;
  static constexpr unsigned kThreads = 32 * kWarps;

  struct Memory {
    std::uint64_t found;
    std::uint32_t least;  ///< ordered bits of the least distance that any warp has seen
    std::uint32_t next;
  };
  Memory* memory = nullptr;  ///< shared by the block

  __device__ explicit SearchBlock(Memory* shared) : memory(shared) {}

  __device__ int part() const { return static_cast<int>(threadIdx.x / 32); }
  __device__ int parts() const { return static_cast<int>(kWarps); }

  __device__ void begin_search() const {
    __syncthreads();
    if (threadIdx.x == 0) {
      memory->found = ~std::uint64_t{0};
      memory->least = ~std::uint32_t{0};
    }
    __syncthreads();
  }

  /// A bound for the search, no worse than `mine`. How much better it is depends on timing, but no
  /// result depends on it.
  __device__ float least_so_far(float mine) const {
    std::uint32_t least = ordered_bits(mine);
    if (lane() == 0) {
      const std::uint32_t before = atomicMin(&memory->least, least);
      least = before < least ? before : least;
    }
    return from_ordered_bits(broadcast(least, 0));
  }

  /// The minimum of all warps' values.
  __device__ std::uint64_t end_search(std::uint64_t mine) const {
    if (lane() == 0)
      atomicMin(reinterpret_cast<unsigned long long*>(&memory->found),
                static_cast<unsigned long long>(mine));
    __syncthreads();
    return memory->found;
  }
};

using packing::CellTable;
using packing::GridCandidate;
using packing::GridLayout;
using packing::GridScene;
using packing::GridWinner;

constexpr unsigned kThreads = 128;
constexpr unsigned kWarps = kThreads / 32;

__device__ unsigned global_thread() { return blockIdx.x * kThreads + threadIdx.x; }

__global__ void number_cells(std::uint32_t* cells, std::uint32_t count) {
  const unsigned c = global_thread();
  if (c < count) cells[c] = c;
}

__global__ void split_cells(const GridLayout coarse, const GridLayout fine,
                            const std::uint32_t* parents, std::uint32_t count,
                            std::uint32_t* children) {
  const unsigned c = global_thread();
  if (c >= 8 * count) return;
  int i = 0, j = 0, k = 0;
  coarse.coordinates(parents[c / 8], i, j, k);
  const int n = static_cast<int>(c % 8);
  children[c] = fine.id(2 * i + (n & 1), 2 * j + (n >> 1 & 1), 2 * k + (n >> 2));
}

/// One warp a cell if it has many cells of the distance grid, else one thread. In any order.
template <bool kByWarp>
__global__ void keep_active_cells(const __grid_constant__ GridScene scene,
                                  const __grid_constant__ GridLayout prototypes,
                                  const std::uint32_t* cells, std::uint32_t count,
                                  std::uint32_t* kept, std::uint32_t* kept_count) {
  const unsigned c = kByWarp ? global_thread() / 32 : global_thread();
  bool active = false;
  if constexpr (kByWarp) {
    if (c >= count) return;
    active = packing::prototype_cell_active(WarpTeam(), scene, prototypes, cells[c]);
    if (active && threadIdx.x % 32 == 0) kept[atomicAdd(kept_count, 1u)] = cells[c];
  } else {
    active = c < count && packing::prototype_cell_active(SerialTeam(), scene, prototypes, cells[c]);
    const std::uint32_t place = append(WarpTeam(), active, kept_count);
    if (active) kept[place] = cells[c];
  }
}

__global__ void converge_prototypes(const __grid_constant__ GridScene scene,
                                    const __grid_constant__ packing::AscentSettings settings,
                                    const std::uint32_t* cells, std::uint32_t end,
                                    std::uint32_t* next, GridCandidate* candidates) {
  const WarpTeam team;
  for (;;) {
    const std::uint32_t n = take(team, next, 1);
    if (n >= end) return;
    const GridCandidate c = packing::converged_prototype(team, scene, settings, cells[n]);
    if (team.lane() == 0) candidates[n] = c;
  }
}

/// The same, one block a prototype.
__global__ void converge_by_blocks(const __grid_constant__ GridScene scene,
                                   const __grid_constant__ packing::AscentSettings settings,
                                   const std::uint32_t* cells, std::uint32_t end,
                                   std::uint32_t* next, GridCandidate* candidates) {
  __shared__ SearchBlock::Memory memory;
  const SearchBlock block(&memory);
  for (;;) {
    __syncthreads();
    if (threadIdx.x == 0) memory.next = atomicAdd(next, 1u);
    __syncthreads();
    const std::uint32_t n = memory.next;
    if (n >= end) return;
    const GridCandidate c = packing::converged_prototype(block, scene, settings, cells[n]);
    if (threadIdx.x == 0) candidates[n] = c;
  }
}

__global__ void fill_table(const std::uint32_t* cells, std::uint32_t count, std::uint32_t* keys,
                           std::uint32_t* values, std::uint32_t mask) {
  const unsigned n = global_thread();
  if (n >= count) return;
  std::uint32_t at = packing::DistanceGrid::hashed(cells[n]) & mask;
  while (atomicCAS(keys + at, CellTable::kEmpty, cells[n]) != CellTable::kEmpty)
    at = (at + 1) & mask;
  values[at] = n;
}

__global__ void select_ahead(const GridLayout layout, const CellTable table,
                             const GridCandidate* candidates, std::uint32_t count,
                             std::uint32_t* ahead, std::uint32_t* ahead_count) {
  const unsigned n = global_thread();
  if (n >= count || !(candidates[n].radius > 0)) return;
  if (packing::outdone_by_neighbour(layout, table, candidates, n)) return;
  ahead[atomicAdd(ahead_count, 1u)] = n;
}

/// Compares a candidate with all others that outrank their neighbours, one warp a candidate.
__global__ void select_winners(const GridCandidate* candidates, const std::uint32_t* ahead,
                               const std::uint32_t* ahead_count, std::uint32_t* winners,
                               std::uint32_t* winner_count) {
  const WarpTeam team;
  const std::uint32_t count = *ahead_count, warps = gridDim.x * kWarps;
  for (std::uint32_t n = global_thread() / 32; n < count; n += warps) {
    const GridCandidate me = candidates[ahead[n]];
    bool outdone = false;
    for (std::uint32_t first = 0; first < count && !outdone; first += 32) {
      const std::uint32_t other = first + static_cast<std::uint32_t>(team.lane());
      bool mine = false;
      if (other < count && other != n) {
        const GridCandidate c = candidates[ahead[other]];
        mine = goes_before(c, me) && overlap(c, me);
      }
      outdone = team.any(mine);
    }
    if (!outdone && team.lane() == 0) winners[atomicAdd(winner_count, 1u)] = ahead[n];
  }
}

__global__ void certify(const __grid_constant__ GridScene scene, const GridCandidate* candidates,
                        const std::uint32_t* winners, std::uint32_t count, GridWinner* certified) {
  const std::uint32_t n = global_thread() / 32;
  if (n >= count) return;
  const WarpTeam team;
  const GridCandidate c = candidates[winners[n]];
  const double radius = packing::certified_clearance(team, scene, c);
  if (team.lane() == 0) certified[n] = {c, radius};
}

/// Up to this many prototypes, a block works on each.
constexpr std::size_t kMostBlocks = 1024;

enum Counter { kKept, kNext, kAhead, kWinners };

}  // namespace

void DeviceRounds::place_prototypes(const packing::GridLayout& layout) {
  prototypes_ = layout;
  count_ = layout.count();
  cells_ = DeviceArray<std::uint32_t>(queue_, count_);
  launch("placing prototypes", number_cells, blocks_for(count_, kThreads), kThreads,
         queue_.stream(), cells_.data(), static_cast<std::uint32_t>(count_));
}

void DeviceRounds::split_prototypes() {
  const GridLayout coarse = prototypes_;
  prototypes_ = packing::refined(coarse);
  DeviceArray<std::uint32_t> children(queue_, 8 * count_);
  launch("splitting prototype cells", split_cells, blocks_for(8 * count_, kThreads), kThreads,
         queue_.stream(), coarse, prototypes_, cells_.data(), static_cast<std::uint32_t>(count_),
         children.data());
  cells_ = std::move(children);
  count_ *= 8;
}

bool DeviceRounds::converge(const packing::AscentSettings& settings, const packing::GoOn& go_on) {
  const GridScene scene = grid_.scene();
  const cudaStream_t stream = queue_.stream();
  candidates_.release();
  counters_.fill_bytes(0);
  DeviceArray<std::uint32_t> kept(queue_, count_);
  const auto before = static_cast<std::uint32_t>(count_);
  if (scene.grid.layout.level > prototypes_.level + 1)
    launch("looking for active cells", keep_active_cells<true>, blocks_for(before, kWarps),
           kThreads, stream, scene, prototypes_, cells_.data(), before, kept.data(),
           counters_.data() + kKept);
  else
    launch("looking for active cells", keep_active_cells<false>, blocks_for(before, kThreads),
           kThreads, stream, scene, prototypes_, cells_.data(), before, kept.data(),
           counters_.data() + kKept);
  count_ = counters_.at(kKept);
  if (8 * count_ < 7 * kept.size()) {
    cells_ = DeviceArray<std::uint32_t>(queue_, count_);
    cells_.copy(kept, count_);
  } else {
    cells_ = std::move(kept);
  }
  candidates_ = DeviceArray<GridCandidate>(queue_, count_);
  constexpr std::size_t kChunk = std::size_t{1} << 17;  // between two checks of clock and progress
  for (std::size_t from = 0; from < count_; from += kChunk) {
    const std::size_t end = std::min(count_, from + kChunk);
    const auto most = static_cast<std::size_t>(16 * queue_.multiprocessors());
    // Every warp takes one number more than there are.
    const auto next = static_cast<std::uint32_t>(from);
    check(cudaMemcpyAsync(counters_.data() + kNext, &next, sizeof next, cudaMemcpyHostToDevice,
                          stream),
          "starting a round");
    const auto last = static_cast<std::uint32_t>(end);
    if (count_ <= kMostBlocks) {
      launch("letting prototypes converge", converge_by_blocks, std::min(most, count_),
             SearchBlock::kThreads, stream, scene, settings, cells_.data(), last,
             counters_.data() + kNext, candidates_.data());
    } else {
      const std::size_t blocks = std::min<std::size_t>(most, blocks_for(end - from, kWarps));
      launch("letting prototypes converge", converge_prototypes, blocks, kThreads, stream, scene,
             settings, cells_.data(), last, counters_.data() + kNext, candidates_.data());
    }
    if (count_ > kChunk) queue_.wait();
    if (!go_on()) return false;
  }
  return true;
}

std::vector<GridCandidate> DeviceRounds::converged(const packing::AscentSettings& settings,
                                                   const packing::GoOn& go_on) {
  if (!converge(settings, go_on)) return {};
  return candidates_.to_host(count_);
}

std::vector<GridWinner> DeviceRounds::round(const packing::AscentSettings& settings,
                                            const packing::GoOn& go_on) {
  if (!converge(settings, go_on) || count_ == 0) return {};
  const GridScene scene = grid_.scene();
  const cudaStream_t stream = queue_.stream();
  const auto count = static_cast<std::uint32_t>(count_);
  DeviceArray<std::uint32_t> ahead(queue_, count_);
  {
    const std::size_t size = packing::hash_size(count_);
    DeviceArray<std::uint32_t> keys(queue_, size), values(queue_, size);
    keys.fill_bytes(0xFF);
    const auto mask = static_cast<std::uint32_t>(size - 1);
    launch("selecting prototypes", fill_table, blocks_for(count, kThreads), kThreads, stream,
           cells_.data(), count, keys.data(), values.data(), mask);
    launch("selecting prototypes", select_ahead, blocks_for(count, kThreads), kThreads, stream,
           prototypes_, CellTable{keys.data(), values.data(), mask}, candidates_.data(), count,
           ahead.data(), counters_.data() + kAhead);
  }
  DeviceArray<std::uint32_t> winners(queue_, count_);
  const auto most = static_cast<std::size_t>(16 * queue_.multiprocessors());
  launch("selecting prototypes", select_winners,
         std::min<std::size_t>(most, blocks_for(count, kWarps)), kThreads, stream,
         candidates_.data(), ahead.data(), counters_.data() + kAhead, winners.data(),
         counters_.data() + kWinners);
  const std::uint32_t found = counters_.at(kWinners);
  if (found == 0) return {};
  DeviceArray<GridWinner> certified(queue_, found);
  launch("certifying spheres", certify, blocks_for(found, kWarps), kThreads, stream, scene,
         candidates_.data(), winners.data(), found, certified.data());
  return certified.to_host(found);
}

void DeviceRounds::append(const std::vector<Sphere>& spheres) {
  grid_.append(spheres.data(), spheres.size());
  queue_.wait();  // the vector belongs to the caller
}

}  // namespace ist::gpu
