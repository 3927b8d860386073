#pragma once

#include <cstdint>

#include "base/host_device.h"

namespace ist::gpu {

/// The least gaps of two trees, or of some of their pairs of spheres. A's unit frame.
struct GapTotals {
  static constexpr double kNone = 1.7976931348623157e308;

  double gap;                 ///< least of the spheres
  double cover;               ///< least of the cover balls; of what was not opened: a lower bound
  std::uint32_t a, b;         ///< spheres of the least gap
  std::uint32_t visits;       ///< node pairs opened
  std::uint32_t spheres;      ///< sphere pairs measured
  std::uint32_t out_of_time;  ///< 1: visits ended before all was known

  IST_HD void clear() {
    gap = cover = kNone;
    a = b = ~0u;
    visits = spheres = out_of_time = 0;
  }
  /// Takes a gap if it is less. Of equal gaps the spheres of lower number are kept.
  IST_HD void meet(double new_gap, std::uint32_t new_a, std::uint32_t new_b, double new_cover) {
    if (new_gap < gap || (new_gap == gap && (new_a < a || (new_a == a && new_b < b)))) {
      gap = new_gap;
      a = new_a;
      b = new_b;
    }
    cover = new_cover < cover ? new_cover : cover;
  }
  IST_HD void add(const GapTotals& other) {
    meet(other.gap, other.a, other.b, other.cover);
    visits += other.visits;
    spheres += other.spheres;
    out_of_time |= other.out_of_time;
  }
  IST_HD bool overlap() const { return gap <= 0; }
};

}  // namespace ist::gpu
