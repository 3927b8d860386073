#include "cuda/packing/calibrate/on_gpu.h"

#include "cuda/base/atomics.h"
#include "cuda/base/check.h"
#include "cuda/base/warp_team.h"
#include "packing/calibrate/power_relaxation.h"

namespace ist::gpu {
namespace {

/// The threads of a block (base/team.h). All of them must make the same calls.
template <int kThreads>
class BlockTeam {
  static constexpr int kWarps = kThreads / 32;

 public:
  static constexpr int kWidth = kThreads;

  struct Shared {
    std::uint64_t words[kWarps];
  };

  __device__ explicit BlockTeam(Shared& shared) : shared_(shared) {}

  __device__ int lane() const { return static_cast<int>(threadIdx.x); }
  __device__ void sync() const { __syncthreads(); }

  __device__ std::uint64_t min(std::uint64_t value) const {
    exchange(warp_.min(value));
    std::uint64_t least = shared_.words[0];
    for (int w = 1; w < kWarps; ++w) least = shared_.words[w] < least ? shared_.words[w] : least;
    __syncthreads();
    return least;
  }
  __device__ std::uint32_t min(std::uint32_t value) const {
    return static_cast<std::uint32_t>(min(std::uint64_t{value}));
  }
  __device__ double min(double value) const { return from_ordered_bits(min(ordered_bits(value))); }

  __device__ int exclusive_count(bool flag, int& total) const {
    int in_warp = 0;
    const int before = warp_.exclusive_count(flag, in_warp);
    exchange(static_cast<std::uint64_t>(in_warp));
    int earlier = 0;
    total = 0;
    for (int w = 0; w < kWarps; ++w) {
      if (w == static_cast<int>(threadIdx.x / 32)) earlier = total;
      total += static_cast<int>(shared_.words[w]);
    }
    __syncthreads();
    return earlier + before;
  }

  __device__ std::uint32_t broadcast(std::uint32_t value, int from) const {
    if (lane() == from) shared_.words[0] = value;
    __syncthreads();
    const auto result = static_cast<std::uint32_t>(shared_.words[0]);
    __syncthreads();
    return result;
  }

 private:
  /// Writes every warp's value to shared memory.
  __device__ void exchange(std::uint64_t value) const {
    if (threadIdx.x % 32 == 0) shared_.words[threadIdx.x / 32] = value;
    __syncthreads();
  }

  Shared& shared_;
  WarpTeam warp_;
};

constexpr unsigned kWarps = 8;
constexpr unsigned kThreads = 32 * kWarps;
constexpr unsigned kBlocksEach = 6;  // blocks a multiprocessor
// The coarsest levels have few cells with long lists: one block a cell, with this many threads.
constexpr unsigned kLongThreads = 1024;
constexpr int kLongLevels = 3, kBlockLevels = 5;

/// A cell to examine, with its parent's list.
struct PowerTask {
  PowerGridCell cell;
  std::uint32_t first, count;
};

struct PowerRound {
  PowerGrid grid;
  const PowerSite* sites;
  PowerSums* sums;
  PowerTask* tasks[2];          ///< of the levels in turn
  std::uint32_t task_capacity;  ///< in each
  std::uint32_t* lists;
  std::uint32_t list_capacity;
  std::uint32_t* task_counts;  ///< of every level; may exceed the capacity
  std::uint32_t* listed;       ///< likewise
};

__device__ void add_sums(PowerSums& sums, const PowerSums& piece) {
  const auto add = [](std::int64_t& to, std::int64_t value) {
    atomicAdd(reinterpret_cast<unsigned long long*>(&to), static_cast<unsigned long long>(value));
  };
  add(sums.length, piece.length);
  add(sums.x, piece.x);
  add(sums.y, piece.y);
  add(sums.z, piece.z);
}

/// Sum over the warp, modulo 2^64: in three parts whose sums fit 32 bits.
__device__ unsigned long long wide_warp_sum(unsigned long long value) {
  constexpr int kBits = 22;
  constexpr unsigned kMask = (1u << kBits) - 1;
  const unsigned low = warp_sum(static_cast<unsigned>(value) & kMask);
  const unsigned middle = warp_sum(static_cast<unsigned>(value >> kBits) & kMask);
  const unsigned high = warp_sum(static_cast<unsigned>(value >> 2 * kBits));
  return low + (static_cast<unsigned long long>(middle) << kBits) +
         (static_cast<unsigned long long>(high) << 2 * kBits);
}

/// Cuts a cell's columns, one lane a column, and combines each site's sums before they go to shared
/// memory.
__device__ void walk_short(const WarpTeam& team, const PowerRound& round, const PowerBlock& block,
                           const std::uint32_t* list, std::uint32_t count) {
  PowerSums mine[kPowerLeafSites] = {};
  const std::uint32_t width = block.i1 - block.i0;
  const std::uint32_t columns = width * (block.j1 - block.j0);
  for (std::uint32_t k = static_cast<std::uint32_t>(team.lane()); k < columns; k += 32)
    walk_column(round.grid, block, round.sites, list, count, block.i0 + k % width,
                block.j0 + k / width, [&](std::uint32_t site, const PowerSums& piece) {
                  std::uint32_t at = 0;
                  while (list[at] != site) ++at;
                  mine[at].add(piece);
                });
  team.sync();
  for (std::uint32_t at = 0; at < count; ++at) {
    if (!team.any(mine[at].length != 0)) continue;
    const auto sum = [](std::int64_t value) {
      return static_cast<std::int64_t>(wide_warp_sum(static_cast<unsigned long long>(value)));
    };
    const PowerSums all = {sum(mine[at].length), sum(mine[at].x), sum(mine[at].y), sum(mine[at].z)};
    if (team.lane() == 0) add_sums(round.sums[list[at]], all);
  }
}

/// Examines one cell with the whole team; `short_list`: kPowerLeafSites elements of memory that the
/// team shares.
template <class Team>
__device__ void look_into(const Team& team, const PowerRound& round, const PowerTask& task,
                          std::uint32_t* short_list) {
  const PowerGrid& grid = round.grid;
  const std::uint32_t* parent_list = round.lists + task.first;
  const PowerFilter filter(team, grid, task.cell, round.sites, parent_list, task.count);
  /// Writes the first `capacity` sites that pass, and returns how many pass.
  const auto filtered = [&](std::uint32_t* out, std::uint32_t capacity) {
    std::uint32_t kept = 0;
    for (std::uint32_t base = 0; base < task.count; base += Team::kWidth) {
      const std::uint32_t i = base + static_cast<std::uint32_t>(team.lane());
      const bool stays = i < task.count && filter.keeps(round.sites, parent_list[i]);
      int total = 0;
      const std::uint32_t place =
          kept + static_cast<std::uint32_t>(team.exclusive_count(stays, total));
      if (stays && place < capacity) out[place] = parent_list[i];
      kept += static_cast<std::uint32_t>(total);
    }
    team.sync();
    return kept;
  };
  const std::uint32_t kept = filtered(short_list, kPowerLeafSites);
  const std::uint32_t* list = short_list;
  std::uint32_t first = 0;
  if (kept > kPowerLeafSites) {
    first = take(team, round.listed, kept);
    if (first + kept > round.list_capacity) return;  // the host sees it and tries again
    filtered(round.lists + first, kept);
    list = round.lists + first;
  }
  if (kept <= kPowerLeafSites || task.cell.level == 0) {
    const PowerBlock block(grid, task.cell);
    if constexpr (Team::kWidth == 32) {
      if (kept <= kPowerLeafSites) {
        walk_short(team, round, block, list, kept);
        return;
      }
    }
    const std::uint32_t width = block.i1 - block.i0;
    const std::uint32_t columns = width * (block.j1 - block.j0);
    for (std::uint32_t k = static_cast<std::uint32_t>(team.lane()); k < columns; k += Team::kWidth)
      walk_column(
          grid, block, round.sites, list, kept, block.i0 + k % width, block.j0 + k / width,
          [&](std::uint32_t site, const PowerSums& piece) { add_sums(round.sums[site], piece); });
    return;
  }
  const int octant = team.lane();
  const PowerGridCell child = child_of(task.cell, static_cast<std::uint32_t>(octant) & 7);
  const bool needed = octant < 8 && !is_empty(grid, child);
  const std::uint32_t at = append(team, needed, round.task_counts + child.level);
  if (needed && at < round.task_capacity) round.tasks[child.level % 2][at] = {child, first, kept};
}

__host__ __device__ std::uint32_t least(std::uint32_t a, std::uint32_t b) { return a < b ? a : b; }

__global__ void start_round(PowerRound round, std::uint32_t site_count) {
  const std::uint32_t k = blockIdx.x * kThreads + threadIdx.x;
  if (k < site_count) {
    round.lists[k] = k;
    round.sums[k] = {};
  }
  if (k > 0) return;
  const int top = round.grid.levels - 1;
  for (int level = 0; level < top; ++level) round.task_counts[level] = 0;
  round.task_counts[top] = 1;
  *round.listed = site_count;
  round.tasks[top % 2][0] = {{0, 0, 0, top}, 0, site_count};
}

/// A level of few cells: one block a cell.
template <unsigned kEach>
__global__ void __launch_bounds__(kEach) look_into_blocks(PowerRound round, int level) {
  __shared__ typename BlockTeam<kEach>::Shared shared;
  __shared__ std::uint32_t short_list[kPowerLeafSites];
  const BlockTeam<kEach> team(shared);
  const std::uint32_t count = least(round.task_counts[level], round.task_capacity);
  for (std::uint32_t k = blockIdx.x; k < count; k += gridDim.x) {
    look_into(team, round, round.tasks[level % 2][k], short_list);
    team.sync();
  }
}

/// A level of many cells: one warp a cell.
__global__ void __launch_bounds__(kThreads) look_into_cells(PowerRound round, int level) {
  __shared__ std::uint32_t short_lists[kWarps][kPowerLeafSites];
  const WarpTeam team;
  const std::uint32_t count = least(round.task_counts[level], round.task_capacity);
  for (std::uint32_t k = blockIdx.x * kWarps + threadIdx.x / 32; k < count;
       k += gridDim.x * kWarps) {
    look_into(team, round, round.tasks[level % 2][k], short_lists[threadIdx.x / 32]);
    team.sync();
  }
}

__global__ void __launch_bounds__(kThreads)
    sum_lengths(const PowerSums* sums, std::uint32_t count, unsigned long long* total) {
  const std::uint32_t k = blockIdx.x * kThreads + threadIdx.x;
  auto length = static_cast<unsigned long long>(k < count ? sums[k].length : 0);
  for (int apart = 16; apart > 0; apart /= 2) length += __shfl_down_sync(~0u, length, apart);
  if (threadIdx.x % 32 == 0) atomicAdd(total, length);
}

__global__ void __launch_bounds__(kThreads)
    relax_all(PowerSite* sites, const PowerSums* sums, double* shares, std::uint32_t count,
              const unsigned long long* total_length, double volume) {
  const std::uint32_t k = blockIdx.x * kThreads + threadIdx.x;
  if (k >= count) return;
  const auto total = static_cast<std::int64_t>(*total_length);
  shares[k] = share_of(sums[k], total);
  PowerSite site = sites[k];
  relax(site, sums[k], total, volume);
  sites[k] = site;
}

/// The memory of the rounds, which grows as needed.
class Relaxation {
 public:
  Relaxation(Queue& queue, const PowerGrid& grid, std::span<const PowerSite> sites)
      : queue_(queue),
        grid_(grid),
        count_(static_cast<std::uint32_t>(sites.size())),
        sites_(queue, count_),
        sums_(queue, count_),
        shares_(queue, count_),
        total_(queue, 1),
        counters_(queue, kMostPowerLevels + 1),
        lists_(queue, 256 * sites.size() + 65536),
        tasks_{{queue, 32 * sites.size() + 65536}, {queue, 32 * sites.size() + 65536}} {
    sites_.upload(sites);
  }

  void round(double volume) {
    do cut();
    while (!fits());
    const unsigned blocks = blocks_for(count_, kThreads);
    total_.fill_bytes(0);
    launch("relaxing power cells", sum_lengths, blocks, kThreads, queue_.stream(), sums_.data(),
           count_, total_.data());
    launch("relaxing power cells", relax_all, blocks, kThreads, queue_.stream(), sites_.data(),
           sums_.data(), shares_.data(), count_, total_.data(), volume);
  }

  RelaxedSites result() {
    RelaxedSites relaxed{std::vector<PowerSite>(count_), std::vector<double>(count_)};
    sites_.download(std::span(relaxed.sites));
    shares_.download(std::span(relaxed.shares));
    queue_.wait();
    return relaxed;
  }

 private:
  PowerRound view() const {
    return {grid_,
            sites_.data(),
            sums_.data(),
            {tasks_[0].data(), tasks_[1].data()},
            static_cast<std::uint32_t>(tasks_[0].size()),
            lists_.data(),
            static_cast<std::uint32_t>(lists_.size()),
            counters_.data(),
            counters_.data() + kMostPowerLevels};
  }

  void cut() {
    const PowerRound round = view();
    const cudaStream_t stream = queue_.stream();
    const unsigned blocks = kBlocksEach * static_cast<unsigned>(queue_.multiprocessors());
    launch("cutting power cells", start_round, blocks_for(count_, kThreads), kThreads, stream,
           round, count_);
    unsigned most = 1;  // cells of the level
    for (int level = grid_.levels - 1; level >= 0; --level) {
      const int above = grid_.levels - 1 - level;
      if (above < kLongLevels)
        launch("cutting power cells", look_into_blocks<kLongThreads>, most, kLongThreads, stream,
               round, level);
      else if (above < kBlockLevels)
        launch("cutting power cells", look_into_blocks<kThreads>, most, kThreads, stream, round,
               level);
      else
        launch("cutting power cells", look_into_cells, blocks, kThreads, stream, round, level);
      most = least(8 * most, blocks);
    }
  }

  /// True if the last cut fitted; if not, enlarges the buffers.
  bool fits() {
    const std::vector<std::uint32_t> used = counters_.to_host(counters_.size());
    std::uint32_t most = 0;
    for (int level = 0; level < grid_.levels; ++level)
      most = used[static_cast<std::size_t>(level)] > most ? used[static_cast<std::size_t>(level)]
                                                          : most;
    const std::uint32_t listed = used[kMostPowerLevels];
    if (most <= tasks_[0].size() && listed <= lists_.size()) return true;
    for (DeviceArray<PowerTask>& tasks : tasks_) tasks.grow(std::size_t{most} * 2, 0);
    lists_.grow(std::size_t{listed} * 2, 0);
    return false;
  }

  Queue& queue_;
  const PowerGrid& grid_;
  std::uint32_t count_;
  DeviceArray<PowerSite> sites_;
  DeviceArray<PowerSums> sums_;
  DeviceArray<double> shares_;
  DeviceArray<unsigned long long> total_;
  DeviceArray<std::uint32_t> counters_;  ///< tasks of every level, then entries of lists
  DeviceArray<std::uint32_t> lists_;
  DeviceArray<PowerTask> tasks_[2];
};

}  // namespace

RelaxedSites relax_sites(Queue& queue, const WideTree& mesh, const RelaxTask& task,
                         const std::function<void(double)>& report) {
  const ColumnsOnGpu columns(queue, mesh, task.columns);
  if (!columns_measure(columns.length() * task.columns.cross_section(), task.volume)) return {};
  Relaxation relaxation(queue, columns.grid(), task.sites);
  for (int round = 0; round < kRelaxations; ++round) {
    report(static_cast<double>(round) / kRelaxations);
    relaxation.round(task.volume);
  }
  return relaxation.result();
}

}  // namespace ist::gpu
