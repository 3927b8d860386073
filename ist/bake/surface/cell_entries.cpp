#include "bake/surface/cell_entries.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <functional>
#include <numeric>

#include "mesh/triangle_frame.h"

namespace ist {
namespace {

/// Cells are taken to be larger by this where triangles are looked for: of a cell, and of the unit
/// frame.
constexpr double kEnlarged = 0x1p-10, kEnlargedBy = 0x1p-21;

/// A box of cells, `end` not included.
struct CellRange {
  std::uint32_t begin[3], end[3];
};

constexpr std::uint32_t kRow = 16;  ///< cells along an edge of a small range

/// Tells which cells of a small range a triangle meets, by separating axes, each looked at once for
/// all cells that it does not tell apart. In double, rounding not included: cells are enlarged.
class RangeOverlap {
 public:
  /// Cells of edge `cell` from `low` on.
  RangeOverlap(const double low[3], double cell, const LaneCorners& t) : step_(cell) {
    const double half = cell / 2 + (kEnlarged * cell + kEnlargedBy);
    for (int k = 0; k < 3; ++k) first_[k] = low[k] + cell / 2;
    double side[3][3];
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) side[i][k] = t.p[(i + 1) % 3][k] - t.p[i][k];
    cross3(side[0], side[1], normal_);
    const double off = dot3(normal_, t.p[0]);
    const double reach =
        (std::fabs(normal_[0]) + std::fabs(normal_[1]) + std::fabs(normal_[2])) * half;
    low_ = off - reach;
    high_ = off + reach;
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      for (int n = 0; n < 3; ++n) {
        const double* e = side[n];
        const auto along = [&](const double x[3]) { return e[i] * x[j] - e[j] * x[i]; };
        const double p[3] = {along(t.p[0]), along(t.p[1]), along(t.p[2])};
        const double room = (std::fabs(e[j]) + std::fabs(e[i])) * half;
        across_[k][n] = {e[i], e[j], std::min({p[0], p[1], p[2]}) - room,
                         std::max({p[0], p[1], p[2]}) + room};
      }
    }
  }

  /// Calls visit(x, y, z) for cells of the range, at most kRow along each edge.
  template <class Visit>
  void for_cells(const CellRange& range, const Visit& visit) const {
    std::uint32_t of_y[kRow], of_z[kRow];  // bits of x
    for (std::uint32_t y = range.begin[1]; y < range.end[1]; ++y)
      of_y[y - range.begin[1]] = row(range, [&](std::uint32_t x) { return meets(2, x, y); });
    for (std::uint32_t z = range.begin[2]; z < range.end[2]; ++z)
      of_z[z - range.begin[2]] = row(range, [&](std::uint32_t x) { return meets(1, z, x); });
    for (std::uint32_t z = range.begin[2]; z < range.end[2]; ++z)
      for (std::uint32_t y = range.begin[1]; y < range.end[1]; ++y) {
        std::uint32_t bits = of_y[y - range.begin[1]] & of_z[z - range.begin[2]];
        if (bits == 0 || !meets(0, y, z)) continue;
        const double yz = normal_[1] * middle(1, y) + normal_[2] * middle(2, z);
        bits &= row(range, [&](std::uint32_t x) {
          const double at = yz + normal_[0] * middle(0, x);
          return low_ <= at && at <= high_;
        });
        for (; bits != 0; bits &= bits - 1)
          visit(range.begin[0] + static_cast<std::uint32_t>(std::countr_zero(bits)), y, z);
      }
  }

 private:
  /// Across an edge of the cells and a side: where cells meet the triangle.
  struct Axis {
    double i, j, low, high;
  };

  double middle(int k, std::uint32_t at) const { return first_[k] + at * step_; }

  template <class Meets>
  static std::uint32_t row(const CellRange& range, const Meets& meets) {
    std::uint32_t bits = 0;
    for (std::uint32_t x = range.begin[0]; x < range.end[0]; ++x)
      bits |= static_cast<std::uint32_t>(meets(x)) << (x - range.begin[0]);
    return bits;
  }

  /// The axes across edge k; `i` and `j` are the cell's along the next two.
  bool meets(int k, std::uint32_t i, std::uint32_t j) const {
    const double x = middle((k + 1) % 3, i), y = middle((k + 2) % 3, j);
    bool hit = true;
    for (const Axis& axis : across_[k]) {
      const double at = axis.i * y - axis.j * x;
      hit &= (axis.low <= at) & (at <= axis.high);
    }
    return hit;
  }

  double first_[3], step_, normal_[3], low_, high_;
  Axis across_[3][3];
};

/// Calls visit(part) for small parts of a range that hold all cells that the triangle meets: of a
/// large one those in cells kRow times as large that it meets.
template <class Visit>
void for_parts(const double low[3], double cell, const LaneCorners& t, const CellRange& range,
               const Visit& visit) {
  CellRange large;
  bool is_small = true;
  for (int k = 0; k < 3; ++k) {
    is_small = is_small && range.end[k] - range.begin[k] <= kRow;
    large.begin[k] = range.begin[k] / kRow;
    large.end[k] = (range.end[k] - 1) / kRow + 1;
  }
  if (is_small) return visit(range);
  const RangeOverlap overlap(low, kRow * cell, t);
  const std::function<void(const CellRange&)> visit_parts = [&](const CellRange& some) {
    overlap.for_cells(some, [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
      const std::uint32_t at[3] = {x, y, z};
      CellRange part;
      for (int k = 0; k < 3; ++k) {
        part.begin[k] = std::max(range.begin[k], kRow * at[k]);
        part.end[k] = std::min(range.end[k], kRow * (at[k] + 1));
      }
      visit(part);
    });
  };
  for_parts(low, kRow * cell, t, large, visit_parts);
}

/// The cells that may hold a point of a triangle's box.
CellRange range_of(const BrickGrid& grid, const LaneCorners& t) {
  CellRange range;
  const double room = kEnlarged * grid.cell + kEnlargedBy;
  for (int k = 0; k < 3; ++k) {
    const double from = std::min({t.p[0][k], t.p[1][k], t.p[2][k]}) - room - grid.low[k];
    const double to = std::max({t.p[0][k], t.p[1][k], t.p[2][k]}) + room - grid.low[k];
    const double last = grid.cells(k) - 1;
    range.begin[k] =
        static_cast<std::uint32_t>(std::clamp(std::floor(from / grid.cell), 0.0, last));
    range.end[k] =
        static_cast<std::uint32_t>(std::clamp(std::floor(to / grid.cell), 0.0, last)) + 1;
  }
  return range;
}

/// Calls visit(cell) for the cells of a block's triangle.
template <class Visit>
void for_cells_of(const BrickGrid& grid, const SurfaceBlock& block, std::uint32_t lane,
                  const Visit& visit) {
  const LaneCorners t = corners_of(block, lane);
  const RangeOverlap overlap(grid.low, grid.cell, t);
  for_parts(grid.low, grid.cell, t, range_of(grid, t), [&](const CellRange& part) {
    overlap.for_cells(part, [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
      visit(grid.name(x, y, z));
    });
  });
}

/// A triangle meets a cell for each step of the grid along the longest edge of its box.
std::size_t least_entries(const BrickGrid& grid, const std::vector<SurfaceBlock>& blocks) {
  std::size_t count = 0;
  for (const SurfaceBlock& block : blocks)
    for (std::uint32_t lane = 0; lane < block.triangles; ++lane) {
      const LaneCorners t = corners_of(block, lane);
      const CellRange range = range_of(grid, t);
      std::uint32_t longest = 0;
      for (int k = 0; k < 3; ++k) longest = std::max(longest, range.end[k] - range.begin[k]);
      count += longest;
    }
  return count;
}

}  // namespace

std::optional<EntryCounts> count_entries(const BrickGrid& grid,
                                         const std::vector<SurfaceBlock>& blocks,
                                         std::size_t most) {
  if (least_entries(grid, blocks) > most) return std::nullopt;
  const auto places = static_cast<std::size_t>(grid.brick_places());
  std::vector<std::uint64_t> cells(places);
  std::vector<std::uint32_t> entries(places);
  std::atomic<std::size_t> all = 0;
  constexpr auto kRelaxed = std::memory_order_relaxed;
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    for (std::uint32_t lane = 0; lane < blocks[b].triangles && all.load(kRelaxed) <= most; ++lane) {
      std::size_t own = 0;
      for_cells_of(grid, blocks[b], lane, [&](std::uint64_t cell) {
        std::atomic_ref(cells[cell / 64]).fetch_or(std::uint64_t{1} << cell % 64, kRelaxed);
        std::atomic_ref(entries[cell / 64]).fetch_add(1, kRelaxed);
        ++own;
      });
      all.fetch_add(own, kRelaxed);
    }
  });
  EntryCounts counts;
  counts.entries = all;
  if (counts.entries > most) return std::nullopt;
  for (std::size_t i = 0; i < places; ++i) {
    counts.cells += static_cast<std::size_t>(std::popcount(cells[i]));
    counts.bricks += cells[i] != 0 ? 1 : 0;
    counts.fullest_brick = std::max<std::size_t>(counts.fullest_brick, entries[i]);
  }
  return counts;
}

// Bricks first, then what is in them: far less to sort.
std::optional<std::vector<CellEntry>> find_entries(const BrickGrid& grid,
                                                   const std::vector<SurfaceBlock>& blocks,
                                                   std::size_t most) {
  if (least_entries(grid, blocks) > most) return std::nullopt;
  std::vector<std::vector<CellEntry>> of_block(blocks.size());
  std::atomic<std::size_t> all = 0;
  std::vector<std::uint32_t> place(static_cast<std::size_t>(grid.brick_places()) + 1);
  constexpr auto kRelaxed = std::memory_order_relaxed;
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    for (std::uint32_t lane = 0; lane < blocks[b].triangles && all.load(kRelaxed) <= most; ++lane) {
      const std::size_t before = of_block[b].size();
      for_cells_of(grid, blocks[b], lane, [&](std::uint64_t cell) {
        of_block[b].push_back({cell, static_cast<std::uint32_t>(kWidth * b + lane)});
        std::atomic_ref(place[cell / 64 + 1]).fetch_add(1, kRelaxed);
      });
      all.fetch_add(of_block[b].size() - before, kRelaxed);
    }
  });
  const std::size_t count = all;
  if (count > most) return std::nullopt;
  std::partial_sum(place.begin(), place.end(), place.begin());
  std::vector<CellEntry> entries(count);
  std::vector<std::uint32_t> next(place.begin(), place.end() - 1);
  tbb::parallel_for(std::size_t{0}, of_block.size(), [&](std::size_t b) {
    for (const CellEntry& entry : of_block[b])
      entries[std::atomic_ref(next[entry.cell / 64]).fetch_add(1, kRelaxed)] = entry;
  });
  tbb::parallel_for(std::size_t{0}, next.size(), [&](std::size_t brick) {
    std::sort(entries.begin() + place[brick], entries.begin() + place[brick + 1]);
  });
  return entries;
}

}  // namespace ist
