#pragma once

#include "base/host_device.h"
#include "base/team.h"
#include "mesh/hierarchy/line_lattice.h"
#include "packing/backend/tasks.h"

// The subdivision that cuts a solid's columns at the power cells of sites, for host and device. Its
// cells, their sites and the resulting pieces depend on columns and sites alone.

namespace ist {

IST_HD inline double power(const PowerSite& site, double x, double y, double z) {
  const double dx = x - site.x, dy = y - site.y, dz = z - site.z;
  return dx * dx + dy * dy + dz * dz - site.weight;
}

/// Cuts the segment [x0, x1] of the line (·, y, z) at the power cells of the listed sites and calls
/// add(site, from, to) for each piece, from left to right. Exact: along a line all powers share the
/// term x², so their lower envelope consists of straight lines, and its sites follow each other by
/// rising x. The order of the list does not matter: among sites with equal power the one that wins
/// further on is taken, and among twins the one of smaller index.
template <class Add>
IST_HD void cut_by_power_cells(const PowerSite* sites, const std::uint32_t* list, std::uint32_t n,
                               double y, double z, double x0, double x1, Add&& add) {
  std::uint32_t current = list[0];
  double least = power(sites[current], x0, y, z);
  const auto ahead_of = [sites](std::uint32_t a, std::uint32_t b) {
    return sites[a].x != sites[b].x ? sites[a].x > sites[b].x : a < b;
  };
  for (std::uint32_t k = 1; k < n; ++k) {
    const double p = power(sites[list[k]], x0, y, z);
    if (p > least || (p == least && !ahead_of(list[k], current))) continue;
    least = p;
    current = list[k];
  }
  for (double x = x0;;) {
    const PowerSite& here = sites[current];
    const double here_power = power(here, x, y, z);
    double end = x1;
    std::uint32_t next = current;
    for (std::uint32_t k = 0; k < n; ++k) {
      const PowerSite& other = sites[list[k]];
      const double ahead = other.x - here.x;
      if (!(ahead > 0)) continue;
      // The position where the powers are equal; measured from x to keep digits.
      const double t = x + (power(other, x, y, z) - here_power) / (2 * ahead);
      if (t > end || (t == end && (next == current || !ahead_of(list[k], next)))) continue;
      end = t;
      next = list[k];
    }
    if (end > x) add(current, x, end);
    if (next == current) return;
    if (end > x) x = end;
    current = next;
  }
}

/// A part of a column that lies inside the solid.
struct ColumnSpan {
  double x0 = 0, x1 = 0;  ///< unit frame, x0 < x1
};

/// Calls add(span) for a line's parts with winding number ≥ 1, by its crossings in order.
template <class Add>
IST_HD void for_spans(const Crossing* crossings, std::uint32_t count, Add&& add) {
  int winding = 0;
  double enter = 0;
  for (std::uint32_t k = 0; k < count; ++k) {
    const int before = winding;
    winding += crossings[k].sign;
    if (before < 1 && winding >= 1) enter = crossings[k].x;
    if (before >= 1 && winding < 1 && crossings[k].x > enter)
      add(ColumnSpan{enter, crossings[k].x});
  }
}

/// Lengths are summed in integers of 2^−38: sums do not depend on the order, and 2^24 columns fit.
constexpr double kLengthUnit = 0x1p-38;
IST_HD inline std::uint64_t length_units(const ColumnSpan& span) {
  return static_cast<std::uint64_t>((span.x1 - span.x0) / kLengthUnit);
}

constexpr std::uint32_t kPowerLeafSites = 8;  ///< few enough to cut columns among all of them
constexpr int kFlagLevel = 2;                 ///< finest level whose cells know if they are empty
constexpr int kMostPowerLevels = 24;

/// Plain arrays of a solid's columns and of an octree over them. A cell of level l contains 2^l
/// columns along y, as many rows and as many steps along x; cells beyond the columns are empty.
struct PowerGrid {
  LineLattice columns;
  double x0 = 0, x1 = 0, step_x = 0;     ///< extent of the solid, steps along x; unit frame
  std::uint32_t nx = 0;                  ///< steps
  int levels = 0;                        ///< the one cell of level levels − 1 contains everything
  double to_fixed = 1;                   ///< scale of the integer sums
  const std::uint32_t* first = nullptr;  ///< spans of column (i, j) start at first[j ny + i]
  const ColumnSpan* spans = nullptr;
  /// A bit for every cell of level l ≥ kFlagLevel: whether any span may meet it.
  const std::uint32_t* flags[kMostPowerLevels] = {};

  /// Cells of a level along an axis.
  IST_HD static std::uint32_t cells(std::uint32_t n, int level) {
    return n == 0 ? 0 : ((n - 1) >> level) + 1;
  }
  IST_HD std::uint64_t cells(int level) const {
    return std::uint64_t{cells(nx, level)} * cells(columns.ny, level) * cells(columns.nz, level);
  }
  /// The plane x = between step s − 1 and s.
  IST_HD double plane(std::uint32_t s) const {
    return s == 0 ? x0 : s >= nx ? x1 : x0 + s * step_x;
  }
};

struct PowerGridCell {
  std::uint32_t s = 0, i = 0, j = 0;  ///< place along x, y and z among the cells of its level
  int level = 0;
};

IST_HD inline PowerGridCell child_of(const PowerGridCell& cell, std::uint32_t octant) {
  return {2 * cell.s + (octant & 1), 2 * cell.i + ((octant >> 1) & 1), 2 * cell.j + (octant >> 2),
          cell.level - 1};
}

/// Index of a cell's bit among those of its level.
IST_HD inline std::uint64_t flag_of(const PowerGrid& grid, const PowerGridCell& cell) {
  return (std::uint64_t{cell.j} * PowerGrid::cells(grid.columns.ny, cell.level) + cell.i) *
             PowerGrid::cells(grid.nx, cell.level) +
         cell.s;
}

/// The columns of a cell and its extent along x.
struct PowerBlock {
  double x0, x1;
  std::uint32_t i0, i1, j0, j1;  ///< columns [i0, i1) of rows [j0, j1)

  IST_HD PowerBlock(const PowerGrid& grid, const PowerGridCell& cell)
      : x0(grid.plane(cell.s << cell.level)),
        x1(grid.plane((cell.s + 1) << cell.level)),
        i0(cell.i << cell.level),
        i1(least((cell.i + 1) << cell.level, grid.columns.ny)),
        j0(cell.j << cell.level),
        j1(least((cell.j + 1) << cell.level, grid.columns.nz)) {}

  /// The part of a span within this one; x0 ≥ x1 if there is none.
  IST_HD ColumnSpan part_of(const ColumnSpan& span) const {
    return {span.x0 > x0 ? span.x0 : x0, span.x1 < x1 ? span.x1 : x1};
  }

  IST_HD static std::uint32_t least(std::uint32_t a, std::uint32_t b) { return a < b ? a : b; }
};

/// True if certainly no span meets the cell. Reads columns below the finest level with flags.
IST_HD inline bool is_empty(const PowerGrid& grid, const PowerGridCell& cell) {
  if (cell.s >= PowerGrid::cells(grid.nx, cell.level) ||
      cell.i >= PowerGrid::cells(grid.columns.ny, cell.level) ||
      cell.j >= PowerGrid::cells(grid.columns.nz, cell.level))
    return true;
  if (cell.level >= kFlagLevel) {
    const std::uint64_t flag = flag_of(grid, cell);
    return ((grid.flags[cell.level][flag >> 5] >> (flag & 31)) & 1u) == 0;
  }
  const PowerBlock block(grid, cell);
  for (std::uint32_t j = block.j0; j < block.j1; ++j)
    for (std::uint32_t i = block.i0; i < block.i1; ++i) {
      const std::uint64_t column = std::uint64_t{j} * grid.columns.ny + i;
      for (std::uint32_t s = grid.first[column]; s < grid.first[column + 1]; ++s)
        if (grid.spans[s].x0 < block.x1 && grid.spans[s].x1 > block.x0) return false;
    }
  return true;
}

/// Calls visit(flag) for the finest cells with flags that a span of column (i, j) may meet.
template <class Visit>
IST_HD void for_flags(const PowerGrid& grid, const ColumnSpan& span, std::uint32_t i,
                      std::uint32_t j, Visit&& visit) {
  constexpr double kMargin = 1e-6;  // steps; exceeds the rounding of planes
  const auto step = [&](double x) {
    return static_cast<std::uint32_t>(x > 0 ? (x < grid.nx ? x : grid.nx) : 0);
  };
  const std::uint32_t first = step((span.x0 - grid.x0) / grid.step_x - kMargin);
  const std::uint32_t last = step((span.x1 - grid.x0) / grid.step_x + kMargin) + 1;
  for (std::uint32_t s = first >> kFlagLevel; s << kFlagLevel < last; ++s)
    if (s < PowerGrid::cells(grid.nx, kFlagLevel))
      visit(flag_of(grid, {s, i >> kFlagLevel, j >> kFlagLevel, kFlagLevel}));
}

template <class Visit>
IST_HD void for_cells_of_row(const PowerGrid& grid, int level, std::uint32_t j, Visit&& visit) {
  for (std::uint32_t i = 0; i < PowerGrid::cells(grid.columns.ny, level); ++i)
    for (std::uint32_t s = 0; s < PowerGrid::cells(grid.nx, level); ++s)
      visit(PowerGridCell{s, i, j, level});
}

/// True if any child of a cell of level > kFlagLevel is flagged.
IST_HD inline bool any_child(const PowerGrid& grid, const PowerGridCell& cell) {
  for (std::uint32_t octant = 0; octant < 8; ++octant)
    if (!is_empty(grid, child_of(cell, octant))) return true;
  return false;
}

/// Middle and half edges of a cell, unit frame.
struct PowerBox {
  double x, y, z, hx, hy, hz;

  IST_HD PowerBox(const PowerGrid& grid, const PowerGridCell& cell) {
    const PowerBlock block(grid, cell);
    hx = 0.5 * (block.x1 - block.x0);
    hy = 0.5 * (block.i1 - block.i0) * grid.columns.step_y;
    hz = 0.5 * (block.j1 - block.j0) * grid.columns.step_z;
    x = block.x0 + hx;
    y = grid.columns.y0 + block.i0 * grid.columns.step_y + hy;
    z = grid.columns.z0 + block.j0 * grid.columns.step_z + hz;
  }
};

/// Tests which of a cell's sites may own a part of it: the others lose everywhere in it to the best
/// site at its middle (differences of powers are affine). Host vectors: power_kernel.h.
struct PowerFilter {
  PowerBox box;
  double least = 0;  ///< power of the best site at the middle
  std::uint32_t best = 0;
  PowerSite winner;

  /// Finds the winner; the smallest index among equals.
  template <class Team>
  IST_HD PowerFilter(const Team& team, const PowerGrid& grid, const PowerGridCell& cell,
                     const PowerSite* sites, const std::uint32_t* list, std::uint32_t count)
      : box(grid, cell) {
    double mine = 1e300;
    std::uint32_t mine_best = 0xFFFFFFFFu;
    for (std::uint32_t i = static_cast<std::uint32_t>(team.lane()); i < count; i += Team::kWidth) {
      const std::uint32_t k = list[i];
      const double p = power(sites[k], box.x, box.y, box.z);
      if (p < mine || (p == mine && k < mine_best)) {
        mine = p;
        mine_best = k;
      }
    }
    least = team.min(mine);
    best = team.min(mine == least ? mine_best : 0xFFFFFFFFu);
    winner = sites[best];
  }

  IST_HD bool keeps(const PowerSite* sites, std::uint32_t k) const {
    if (k == best) return true;
    const PowerSite& site = sites[k];
    const auto size = [](double a) { return a < 0 ? -a : a; };
    const double swing = 2 * (size(site.x - winner.x) * box.hx + size(site.y - winner.y) * box.hy +
                              size(site.z - winner.z) * box.hz);
    return power(site, box.x, box.y, box.z) - least - swing < 0;
  }
};

/// Fixed-point sums of one power cell: ∫1, ∫x, ∫y, ∫z over its pieces of columns.
struct PowerSums {
  std::int64_t length = 0, x = 0, y = 0, z = 0;

  IST_HD void add(const PowerSums& other) {
    length += other.length;
    x += other.x;
    y += other.y;
    z += other.z;
  }
};

/// The terms that a piece adds to its site's sums.
IST_HD inline PowerSums piece_sums(const PowerGrid& grid, double x0, double x1, double y,
                                   double z) {
  const double length = (x1 - x0) * grid.to_fixed;
  return {static_cast<std::int64_t>(length), static_cast<std::int64_t>(length * (0.5 * (x0 + x1))),
          static_cast<std::int64_t>(length * y), static_cast<std::int64_t>(length * z)};
}

/// Cuts column (i, j) within a cell at the power cells of the listed sites and calls
/// add(site, PowerSums) for each piece.
template <class Add>
IST_HD void walk_column(const PowerGrid& grid, const PowerBlock& block, const PowerSite* sites,
                        const std::uint32_t* list, std::uint32_t count, std::uint32_t i,
                        std::uint32_t j, Add&& add) {
  const std::uint64_t column = std::uint64_t{j} * grid.columns.ny + i;
  const std::uint32_t last = grid.first[column + 1];
  for (std::uint32_t s = grid.first[column]; s < last; ++s) {
    const ColumnSpan part = block.part_of(grid.spans[s]);
    if (!(part.x0 < part.x1)) continue;
    const double y = grid.columns.y(i, j), z = grid.columns.z(j);
    cut_by_power_cells(sites, list, count, y, z, part.x0, part.x1,
                       [&](std::uint32_t site, double x0, double x1) {
                         add(site, piece_sums(grid, x0, x1, y, z));
                       });
  }
}

}  // namespace ist
