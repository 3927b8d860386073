#include "build/power_cells.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace ist {
namespace {

constexpr std::size_t kLeafSites = 8;        // few enough to walk columns among all of them
constexpr std::uint32_t kLeafColumns = 2;    // too few columns to pay for a split
constexpr std::size_t kParallelSites = 128;  // below, a split is too small for two threads
constexpr int kMaxDepth = 64;

using SiteList = std::vector<std::uint32_t>;

/// A block of columns, cut to [x0, x1].
struct Block {
  double x0 = 0, x1 = 0;
  std::uint32_t i0 = 0, i1 = 0, j0 = 0, j1 = 0;  // columns [i0, i1) of rows [j0, j1)
};

/// Fixed-point sums of one cell: ∫1, ∫x, ∫y, ∫z over its pieces of columns.
struct CellSums {
  std::int64_t length = 0, x = 0, y = 0, z = 0;
};

class CellIntegrator {
 public:
  CellIntegrator(const ColumnLattice& solid, std::span<const PowerSite> sites)
      : solid_(solid), sites_(sites), sums_(std::vector<CellSums>(sites.size())) {
    // The largest power of two that keeps every sum below 2^62 (coordinates are within ±1).
    for (double sum = solid.length; sum < 0x1p61; sum *= 2) to_fixed_ *= 2;
  }

  std::vector<CellSums> run() {
    SiteList all(sites_.size());
    std::iota(all.begin(), all.end(), 0u);
    const Block block{solid_.box.min().x(), solid_.box.max().x(), 0, solid_.ny, 0, solid_.nz};
    split(block, all, 0);
    std::vector<CellSums> total(sites_.size());
    for (const std::vector<CellSums>& part : sums_)
      for (std::size_t k = 0; k < total.size(); ++k) {
        total[k].length += part[k].length;
        total[k].x += part[k].x;
        total[k].y += part[k].y;
        total[k].z += part[k].z;
      }
    return total;
  }

 private:
  bool empty(const Block& block) const {
    for (std::uint32_t j = block.j0; j < block.j1; ++j)
      for (std::uint32_t i = block.i0; i < block.i1; ++i) {
        const std::size_t column = std::size_t{j} * solid_.ny + i;
        for (std::uint32_t s = solid_.first[column]; s < solid_.first[column + 1]; ++s)
          if (solid_.spans[s].x0 < block.x1 && solid_.spans[s].x1 > block.x0) return false;
      }
    return true;
  }

  /// The listed sites whose cells may reach into the block: the others lose everywhere in it to
  /// the site that is best at its middle (the difference of two powers is affine).
  SiteList reaching(const Block& block, const SiteList& list) const {
    const double hx = 0.5 * (block.x1 - block.x0);
    const double hy = 0.5 * (block.i1 - block.i0) * solid_.step_y;
    const double hz = 0.5 * (block.j1 - block.j0) * solid_.step_z;
    const double x = block.x0 + hx;
    const double y = solid_.box.min().y() + block.i0 * solid_.step_y + hy;
    const double z = solid_.box.min().z() + block.j0 * solid_.step_z + hz;
    std::uint32_t best = list[0];
    double least = power(sites_[best], x, y, z);
    for (const std::uint32_t k : list) {
      const double p = power(sites_[k], x, y, z);
      if (p < least) {
        least = p;
        best = k;
      }
    }
    const PowerSite& winner = sites_[best];
    SiteList kept;
    for (const std::uint32_t k : list) {
      const PowerSite& site = sites_[k];
      const double swing =
          2 * (std::abs(site.x - winner.x) * hx + std::abs(site.y - winner.y) * hy +
               std::abs(site.z - winner.z) * hz);
      const double lead = power(site, x, y, z) - least - swing;
      if (lead < 0 || k == best) kept.push_back(k);
    }
    return kept;
  }

  void split(const Block& block, const SiteList& parent_list, int depth) {
    if (empty(block)) return;
    const SiteList list = reaching(block, parent_list);
    const std::uint32_t ni = block.i1 - block.i0, nj = block.j1 - block.j0;
    if (list.size() <= kLeafSites || ni * nj <= kLeafColumns || depth == kMaxDepth) {
      walk(block, list);
      return;
    }
    const double lx = block.x1 - block.x0, ly = ni * solid_.step_y, lz = nj * solid_.step_z;
    Block low = block, high = block;
    if (ni > 1 && ly >= lx && (ly >= lz || nj == 1)) {
      low.i1 = high.i0 = block.i0 + ni / 2;
    } else if (nj > 1 && lz >= lx) {
      low.j1 = high.j0 = block.j0 + nj / 2;
    } else {
      low.x1 = high.x0 = 0.5 * (block.x0 + block.x1);
    }
    if (list.size() >= kParallelSites) {
      tbb::parallel_invoke([&] { split(low, list, depth + 1); },
                           [&] { split(high, list, depth + 1); });
    } else {
      split(low, list, depth + 1);
      split(high, list, depth + 1);
    }
  }

  void walk(const Block& block, const SiteList& list) {
    std::vector<CellSums>& sums = sums_.local();
    for (std::uint32_t j = block.j0; j < block.j1; ++j)
      for (std::uint32_t i = block.i0; i < block.i1; ++i) {
        const double y = solid_.y(i, j), z = solid_.z(j);
        const std::size_t column = std::size_t{j} * solid_.ny + i;
        for (std::uint32_t s = solid_.first[column]; s < solid_.first[column + 1]; ++s) {
          const double from = std::max(solid_.spans[s].x0, block.x0);
          const double to = std::min(solid_.spans[s].x1, block.x1);
          if (!(from < to)) continue;
          cut_by_power_cells(sites_.data(), list.data(), static_cast<std::uint32_t>(list.size()), y,
                             z, from, to, [&](std::uint32_t site, double x0, double x1) {
                               const double length = (x1 - x0) * to_fixed_;
                               CellSums& sum = sums[site];
                               sum.length += static_cast<std::int64_t>(length);
                               sum.x += static_cast<std::int64_t>(length * (0.5 * (x0 + x1)));
                               sum.y += static_cast<std::int64_t>(length * y);
                               sum.z += static_cast<std::int64_t>(length * z);
                             });
        }
      }
  }

  const ColumnLattice& solid_;
  std::span<const PowerSite> sites_;
  double to_fixed_ = 1;
  tbb::enumerable_thread_specific<std::vector<CellSums>> sums_;
};

}  // namespace

std::vector<PowerCell> power_cells(const ColumnLattice& solid, std::span<const PowerSite> sites) {
  std::vector<PowerCell> cells(sites.size());
  if (sites.empty() || !(solid.length > 0)) return cells;
  const std::vector<CellSums> sums = CellIntegrator(solid, sites).run();
  std::int64_t total = 0;
  for (const CellSums& sum : sums) total += sum.length;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    if (sums[k].length <= 0) continue;
    const double length = static_cast<double>(sums[k].length);
    cells[k] = {length / static_cast<double>(total), static_cast<double>(sums[k].x) / length,
                static_cast<double>(sums[k].y) / length, static_cast<double>(sums[k].z) / length};
  }
  return cells;
}

}  // namespace ist
