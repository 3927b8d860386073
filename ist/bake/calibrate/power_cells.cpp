#include "bake/calibrate/power_cells.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

namespace ist {
namespace {

constexpr std::size_t kParallelSites = 64;  // below, a cell is too small for several threads
constexpr double kMostSteps = 4096;         // along x

/// Walks down the octree with the sites that each cell is left with.
class CellIntegrator {
 public:
  CellIntegrator(const PowerGrid& grid, std::span<const PowerSite> sites)
      : grid_(grid), sites_(sites), sums_(std::vector<PowerSums>(sites.size())) {}

  std::vector<PowerSums> run() {
    std::vector<std::uint32_t> lists(sites_.size());
    std::iota(lists.begin(), lists.end(), 0u);
    look_into({0, 0, 0, grid_.levels - 1}, lists, 0);
    std::vector<PowerSums> total(sites_.size());
    for (const std::vector<PowerSums>& part : sums_)
      for (std::size_t k = 0; k < total.size(); ++k) {
        total[k].length += part[k].length;
        total[k].x += part[k].x;
        total[k].y += part[k].y;
        total[k].z += part[k].z;
      }
    return total;
  }

 private:
  /// `lists` ends with the parent's list, which starts at `first`; it comes back as it was.
  void look_into(const PowerGridCell& cell, std::vector<std::uint32_t>& lists, std::size_t first) {
    const std::size_t end = lists.size();
    const auto count = static_cast<std::uint32_t>(end - first);
    const PowerFilter filter(SerialTeam(), grid_, cell, sites_.data(), lists.data() + first, count);
    for (std::size_t i = first; i < end; ++i)
      if (filter.keeps(sites_.data(), lists[i])) lists.push_back(lists[i]);
    const std::size_t kept = lists.size() - end;
    if (kept <= kPowerLeafSites || cell.level == 0) {
      walk(cell, lists.data() + end, static_cast<std::uint32_t>(kept));
    } else if (kept >= kParallelSites) {
      tbb::parallel_for(0u, 8u, [&](std::uint32_t octant) {
        const PowerGridCell child = child_of(cell, octant);
        if (is_empty(grid_, child)) return;
        std::vector<std::uint32_t> own(lists.begin() + static_cast<std::ptrdiff_t>(end),
                                       lists.end());
        look_into(child, own, 0);
      });
    } else {
      for (std::uint32_t octant = 0; octant < 8; ++octant) {
        const PowerGridCell child = child_of(cell, octant);
        if (!is_empty(grid_, child)) look_into(child, lists, end);
      }
    }
    lists.resize(end);
  }

  void walk(const PowerGridCell& cell, const std::uint32_t* list, std::uint32_t count) {
    std::vector<PowerSums>& sums = sums_.local();
    const PowerBlock block(grid_, cell);
    for (std::uint32_t j = block.j0; j < block.j1; ++j)
      for (std::uint32_t i = block.i0; i < block.i1; ++i)
        walk_column(grid_, block, sites_.data(), list, count, i, j,
                    [&](std::uint32_t site, const PowerSums& piece) {
                      PowerSums& sum = sums[site];
                      sum.length += piece.length;
                      sum.x += piece.x;
                      sum.y += piece.y;
                      sum.z += piece.z;
                    });
  }

  const PowerGrid& grid_;
  std::span<const PowerSite> sites_;
  tbb::enumerable_thread_specific<std::vector<PowerSums>> sums_;
};

void set_flag(std::vector<std::uint32_t>& flags, std::uint64_t flag) {
  std::atomic_ref<std::uint32_t>(flags[flag >> 5])
      .fetch_or(1u << (flag & 31), std::memory_order_relaxed);
}

}  // namespace

PowerGrid plan_power_grid(const ColumnPlan& plan, double length) {
  PowerGrid grid;
  grid.columns = plan.lines;
  grid.x0 = plan.x0;
  grid.x1 = plan.x1;
  const double step = std::max(plan.lines.step_y, plan.lines.step_z);
  grid.nx = static_cast<std::uint32_t>(
      std::clamp(std::ceil((plan.x1 - plan.x0) / step), 1.0, kMostSteps));
  grid.step_x = (plan.x1 - plan.x0) / grid.nx;
  const std::uint32_t most = std::max({grid.nx, grid.columns.ny, grid.columns.nz});
  grid.levels = kFlagLevel + 1;
  while (PowerGrid::cells(most, grid.levels - 1) > 1) ++grid.levels;
  // The largest power of two that keeps every sum below 2^62 (coordinates are within ±1).
  for (double sum = length; sum > 0 && sum < 0x1p61; sum *= 2) grid.to_fixed *= 2;
  return grid;
}

PowerOctree::PowerOctree(const ColumnLattice& solid)
    : grid_(plan_power_grid(solid, solid.length)), flags_(static_cast<std::size_t>(grid_.levels)) {
  grid_.first = solid.first.data();
  grid_.spans = solid.spans.data();
  for (int level = kFlagLevel; level < grid_.levels; ++level) {
    auto& flags = flags_[static_cast<std::size_t>(level)];
    flags.resize((grid_.cells(level) + 31) / 32);
    grid_.flags[level] = flags.data();
  }
  auto& finest = flags_[kFlagLevel];
  tbb::parallel_for(std::uint32_t{0}, grid_.columns.nz, [&](std::uint32_t j) {
    for (std::uint32_t i = 0; i < grid_.columns.ny; ++i) {
      const std::size_t column = std::size_t{j} * grid_.columns.ny + i;
      for (std::uint32_t s = solid.first[column]; s < solid.first[column + 1]; ++s)
        for_flags(grid_, solid.spans[s], i, j, [&](std::uint64_t flag) { set_flag(finest, flag); });
    }
  });
  for (int level = kFlagLevel + 1; level < grid_.levels; ++level) {
    auto& flags = flags_[static_cast<std::size_t>(level)];
    tbb::parallel_for(std::uint32_t{0}, PowerGrid::cells(grid_.columns.nz, level),
                      [&](std::uint32_t j) {
                        for_cells_of_row(grid_, level, j, [&](const PowerGridCell& cell) {
                          if (any_child(grid_, cell)) set_flag(flags, flag_of(grid_, cell));
                        });
                      });
  }
}

std::vector<PowerSums> PowerOctree::cell_sums(std::span<const PowerSite> sites) const {
  if (sites.empty() || grid_.spans == nullptr || grid_.first[grid_.columns.lines()] == 0)
    return std::vector<PowerSums>(sites.size());
  return CellIntegrator(grid_, sites).run();
}

}  // namespace ist
