#include "packing/calibrate/power_kernel.h"

#include "base/bits.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "packing/calibrate/power_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<double, kMostPowerLanes>;
using Vector = hn::Vec<Tag>;

constexpr double kFar = 1e300;  ///< exceeds every power, and every position along a line

static_assert(kPowerLeafSites == kMostPowerLanes);

/// Powers of sites at a point, in power()'s order of sums.
HWY_INLINE Vector powers_at(Vector dx, Vector dy, Vector dz, Vector weight) {
  return ((dx * dx + dy * dy) + dz * dz) - weight;
}

/// One bit a lane.
HWY_INLINE std::uint32_t mask_bits(hn::Mask<Tag> mask) {
  const Tag d;
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  return bytes[0] & ((1u << hn::Lanes(d)) - 1);
}

std::size_t keep_sites(const PowerBox& box, const SiteArrays& sites, std::size_t count,
                       const SiteArrays& kept, double* powers) {
  const Tag d;
  const std::size_t lanes = hn::Lanes(d);
  const Vector x = hn::Set(d, box.x), y = hn::Set(d, box.y), z = hn::Set(d, box.z);
  Vector least = hn::Set(d, kFar);
  for (std::size_t i = 0; i < count; i += lanes) {
    const Vector p = powers_at(x - hn::LoadU(d, sites.x + i), y - hn::LoadU(d, sites.y + i),
                               z - hn::LoadU(d, sites.z + i), hn::LoadU(d, sites.weight + i));
    const Vector valid = hn::IfThenElse(hn::FirstN(d, count - i), p, hn::Set(d, kFar));
    hn::StoreU(valid, d, powers + i);
    least = hn::Min(least, valid);
  }
  const double smallest = hn::GetLane(hn::MinOfLanes(d, least));
  std::size_t best = 0;
  while (best + 1 < count && powers[best] != smallest) ++best;

  const Vector best_x = hn::Set(d, sites.x[best]), best_y = hn::Set(d, sites.y[best]),
               best_z = hn::Set(d, sites.z[best]);
  const Vector hx = hn::Set(d, box.hx), hy = hn::Set(d, box.hy), hz = hn::Set(d, box.hz);
  std::size_t size = 0;
  const auto keep = [&](std::size_t i) {
    kept.x[size] = sites.x[i];
    kept.y[size] = sites.y[i];
    kept.z[size] = sites.z[i];
    kept.weight[size] = sites.weight[i];
    kept.number[size++] = sites.number[i];
  };
  for (std::size_t i = 0; i < count; i += lanes) {
    const Vector swing = hn::Set(d, 2) * ((hn::Abs(hn::LoadU(d, sites.x + i) - best_x) * hx +
                                           hn::Abs(hn::LoadU(d, sites.y + i) - best_y) * hy) +
                                          hn::Abs(hn::LoadU(d, sites.z + i) - best_z) * hz);
    const auto wins = hn::LoadU(d, powers + i) - hn::Set(d, smallest) - swing < hn::Zero(d);
    std::uint32_t left = mask_bits(hn::And(wins, hn::FirstN(d, count - i)));
    if (best - i < lanes) left |= 1u << (best - i);
    for (const std::uint32_t k : set_bits(left)) keep(i + k);
  }
  return size;
}

/// Up to kPowerLeafSites sites; unused lanes are far to the left and never win.
class CellWalk {
 public:
  CellWalk(const PowerGrid& grid, const SiteArrays& sites, std::size_t count)
      : grid_(grid), count_(count) {
    for (std::size_t k = 0; k < kMostPowerLanes; ++k) {
      const bool is_site = k < count;
      x_[k] = is_site ? sites.x[k] : -1e150;
      y_[k] = is_site ? sites.y[k] : 0;
      z_[k] = is_site ? sites.z[k] : 0;
      weight_[k] = is_site ? sites.weight[k] : 0;
    }
  }

  const PowerSums& sums(std::size_t k) const { return sums_[k]; }

  /// The part [from, to) of a column.
  void cut(double y, double z, double from, double to) {
    if (count_ == 1) {
      add(0, from, to, y, z);
      return;
    }
    y_now_ = y;
    z_now_ = z;
    std::size_t current = foremost(powers_, measure(from));
    for (double x = from;;) {
      const double end = next_change(x, current);
      if (!(end < to)) {
        if (to > x) add(current, x, to, y, z);
        return;
      }
      const std::size_t next = foremost(changes_, end);
      if (end > x) {
        add(current, x, end, y, z);
        x = end;
        measure(x);
      }
      current = next;
    }
  }

 private:
  /// Computes the powers of all sites at x; returns the least.
  double measure(double x) {
    const Tag d;
    Vector least = hn::Set(d, kFar);
    for (std::size_t k = 0; k < kMostPowerLanes; k += hn::Lanes(d)) {
      const Vector p =
          powers_at(hn::Set(d, x) - hn::Load(d, x_ + k), hn::Set(d, y_now_) - hn::Load(d, y_ + k),
                    hn::Set(d, z_now_) - hn::Load(d, z_ + k), hn::Load(d, weight_ + k));
      hn::Store(p, d, powers_ + k);
      least = hn::Min(least, p);
    }
    return hn::GetLane(hn::MinOfLanes(d, least));
  }

  /// The position where the first site becomes as good as `current`; kFar if none does.
  double next_change(double x, std::size_t current) {
    const Tag d;
    const Vector here = hn::Set(d, powers_[current]), here_x = hn::Set(d, x_[current]);
    Vector first = hn::Set(d, kFar);
    for (std::size_t k = 0; k < kMostPowerLanes; k += hn::Lanes(d)) {
      const Vector ahead = hn::Load(d, x_ + k) - here_x;
      const auto is_ahead = ahead > hn::Zero(d);
      // Avoids divisions by zero, which trap if floating-point exceptions do.
      const Vector twice = hn::IfThenElse(is_ahead, hn::Set(d, 2) * ahead, hn::Set(d, 1));
      // Measured from x to keep digits.
      const Vector at = hn::Set(d, x) + (hn::Load(d, powers_ + k) - here) / twice;
      const Vector change = hn::IfThenElse(is_ahead, at, hn::Set(d, kFar));
      hn::Store(change, d, changes_ + k);
      first = hn::Min(first, change);
    }
    return hn::GetLane(hn::MinOfLanes(d, first));
  }

  /// Among the sites with this value the one furthest along x; among twins the first.
  std::size_t foremost(const double* values, double value) const {
    const Tag d;
    std::uint32_t equal = 0;
    for (std::size_t k = 0; k < kMostPowerLanes; k += hn::Lanes(d))
      equal |= mask_bits(hn::Load(d, values + k) == hn::Set(d, value)) << k;
    std::size_t best = hwy::Num0BitsBelowLS1Bit_Nonzero32(equal);
    for (equal &= equal - 1; equal != 0; equal &= equal - 1) {
      const std::size_t k = hwy::Num0BitsBelowLS1Bit_Nonzero32(equal);
      if (x_[k] > x_[best]) best = k;
    }
    return best;
  }

  void add(std::size_t k, double x0, double x1, double y, double z) {
    sums_[k].add(piece_sums(grid_, x0, x1, y, z));
  }

  const PowerGrid& grid_;
  const std::size_t count_;
  double y_now_ = 0, z_now_ = 0;  ///< of the column
  alignas(64) double x_[kMostPowerLanes], y_[kMostPowerLanes], z_[kMostPowerLanes];
  alignas(64) double weight_[kMostPowerLanes];
  alignas(64) double powers_[kMostPowerLanes], changes_[kMostPowerLanes];
  PowerSums sums_[kMostPowerLanes];
};

void walk_cell(const PowerGrid& grid, const PowerGridCell& cell, const SiteArrays& sites,
               std::size_t count, PowerSums* sums) {
  const PowerBlock block(grid, cell);
  CellWalk walk(grid, sites, count);
  for (std::uint32_t j = block.j0; j < block.j1; ++j)
    for (std::uint32_t i = block.i0; i < block.i1; ++i) {
      const std::uint64_t column = std::uint64_t{j} * grid.columns.ny + i;
      for (std::uint32_t s = grid.first[column]; s < grid.first[column + 1]; ++s) {
        const ColumnSpan part = block.part_of(grid.spans[s]);
        if (part.x0 < part.x1) walk.cut(grid.columns.y(i, j), grid.columns.z(j), part.x0, part.x1);
      }
    }
  for (std::size_t k = 0; k < count; ++k) sums[sites.number[k]].add(walk.sums(k));
}

}  // namespace
}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(keep_sites);
HWY_EXPORT(walk_cell);

std::size_t keep_sites(const PowerBox& box, const SiteArrays& sites, std::size_t count,
                       const SiteArrays& kept, double* powers) {
  return HWY_DYNAMIC_DISPATCH(keep_sites)(box, sites, count, kept, powers);
}

void walk_cell(const PowerGrid& grid, const PowerGridCell& cell, const SiteArrays& sites,
               std::size_t count, PowerSums* sums) {
  HWY_DYNAMIC_DISPATCH(walk_cell)(grid, cell, sites, count, sums);
}

}  // namespace ist
#endif
