#include "packing/calibrate/host_calibration.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <algorithm>
#include <atomic>
#include <cmath>

#include "packing/calibrate/power_kernel.h"
#include "packing/calibrate/protrusion.h"

namespace ist {
namespace {

constexpr std::size_t kParallelSites = 64;  // smaller cells are not worth several threads
constexpr double kMostSteps = 4096;         // along x

/// Lists of sites one after another: each cell's list follows its parent's.
class SiteLists {
 public:
  std::size_t size() const { return size_; }

  /// The list from `first` on. Calls of reserve() and append() move it.
  SiteArrays list(std::size_t first) {
    return SiteArrays{coordinates_[0].data(), coordinates_[1].data(), coordinates_[2].data(),
                      weights_.data(), numbers_.data()}
        .from(first);
  }
  double* powers() { return powers_.data(); }

  void reserve(std::size_t count) {
    const std::size_t needed = size_ + count + kMostPowerLanes;
    if (needed <= numbers_.size()) return;
    for (std::vector<double>& column : coordinates_) column.resize(2 * needed);
    weights_.resize(2 * needed);
    numbers_.resize(2 * needed);
    powers_.resize(2 * needed);
  }

  void resize(std::size_t size) { size_ = size; }  ///< at most the capacity

  void append(const SiteArrays& sites, std::size_t count) {
    reserve(count);
    const SiteArrays to = list(size_);
    std::copy_n(sites.x, count, to.x);
    std::copy_n(sites.y, count, to.y);
    std::copy_n(sites.z, count, to.z);
    std::copy_n(sites.weight, count, to.weight);
    std::copy_n(sites.number, count, to.number);
    size_ += count;
  }

 private:
  std::vector<double> coordinates_[3], weights_, powers_;
  std::vector<std::uint32_t> numbers_;
  std::size_t size_ = 0;
};

/// Descends the octree with the remaining sites of each cell.
class CellIntegrator {
 public:
  CellIntegrator(const PowerGrid& grid, std::span<const PowerSite> sites)
      : grid_(grid), sites_(sites), sums_(std::vector<PowerSums>(sites.size())) {}

  std::vector<PowerSums> run() {
    SiteLists lists;
    lists.reserve(sites_.size());
    const SiteArrays all = lists.list(0);
    for (std::size_t k = 0; k < sites_.size(); ++k) {
      all.x[k] = sites_[k].x;
      all.y[k] = sites_[k].y;
      all.z[k] = sites_[k].z;
      all.weight[k] = sites_[k].weight;
      all.number[k] = static_cast<std::uint32_t>(k);
    }
    lists.resize(sites_.size());
    look_into({0, 0, 0, grid_.levels - 1}, lists, 0);
    std::vector<PowerSums> total(sites_.size());
    for (const std::vector<PowerSums>& part : sums_)
      for (std::size_t k = 0; k < total.size(); ++k) total[k].add(part[k]);
    return total;
  }

 private:
  /// `lists` ends with the parent's list, which starts at `first`; it is restored on return.
  void look_into(const PowerGridCell& cell, SiteLists& lists, std::size_t first) {
    const std::size_t end = lists.size();
    lists.reserve(end - first);
    const std::size_t kept = keep_sites(PowerBox(grid_, cell), lists.list(first), end - first,
                                        lists.list(end), lists.powers());
    lists.resize(end + kept);
    if (kept <= kPowerLeafSites) {
      walk_cell(grid_, cell, lists.list(end), kept, sums_.local().data());
    } else if (cell.level == 0) {
      walk_among_many(cell, lists.list(end).number, static_cast<std::uint32_t>(kept));
    } else if (kept >= kParallelSites) {
      tbb::parallel_for(0u, 8u, [&](std::uint32_t octant) {
        const PowerGridCell child = child_of(cell, octant);
        if (is_empty(grid_, child)) return;
        SiteLists own;
        own.append(lists.list(end), kept);
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

  /// Handles a column with more sites than a leaf has.
  void walk_among_many(const PowerGridCell& cell, const std::uint32_t* list, std::uint32_t count) {
    std::vector<PowerSums>& sums = sums_.local();
    walk_column(grid_, PowerBlock(grid_, cell), sites_.data(), list, count, cell.i, cell.j,
                [&](std::uint32_t site, const PowerSums& piece) { sums[site].add(piece); });
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

RelaxedSites relax_on_host(const MeshSolid& solid, const RelaxTask& task,
                           const std::function<void(double)>& report) {
  const ColumnLattice lattice = cut_columns(solid, task.columns);
  if (!columns_measure(lattice.volume(), task.volume)) return {};
  std::vector<PowerSite> sites(task.sites.begin(), task.sites.end());
  const PowerOctree octree(lattice);
  std::vector<double> shares(sites.size());
  for (int round = 0; round < kRelaxations; ++round) {
    report(static_cast<double>(round) / kRelaxations);
    const std::vector<PowerSums> sums = octree.cell_sums(sites);
    std::int64_t total = 0;
    for (const PowerSums& sum : sums) total += sum.length;
    for (std::size_t k = 0; k < sites.size(); ++k) {
      shares[k] = share_of(sums[k], total);
      relax(sites[k], sums[k], total, task.volume);
    }
  }
  return {std::move(sites), std::move(shares)};
}

double protrusion_on_host(const MeshSolid& solid, std::span<const Sphere> balls) {
  std::vector<double> out(balls.size());
  tbb::parallel_for(std::size_t{0}, out.size(), [&](std::size_t k) {
    const Eigen::Vector3d centre(balls[k].x, balls[k].y, balls[k].z);
    out[k] = protrusion_of(balls[k].r, solid.closest_point(centre).distance, solid.inside(centre));
  });
  return std::max(0.0, *std::max_element(out.begin(), out.end()));
}

}  // namespace ist
