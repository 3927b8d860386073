#pragma once

#include <cstdint>

#include "cuda/query/cover_ref.h"
#include "cuda/query/pair_place.h"
#include "cuda/query/tree_ref.h"
#include "numerics/host_device.h"

namespace ist::gpu {

/// What is known of two trees, or of a part of the pairs of their spheres. A's unit frame.
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
  /// Of equal gaps the spheres of lower number.
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

/// Length within which all of both trees and the way between them lie, A's unit frame (span() of
/// query/base/precision.h).
IST_HD inline double span_of(const TreeRef& a, const CoverRef& cover_a, const TreeRef& b,
                             const CoverRef& cover_b, const PairMap& a_from_b) {
  const double centre[3] = {b.root[0], b.root[1], b.root[2]};
  double moved[3], sum = 0;
  a_from_b.apply(centre, moved);
  for (int k = 0; k < 3; ++k) {
    const double apart = moved[k] - a.root[k];
    sum += apart < 0 ? -apart : apart;
  }
  const double reach_a = a.root[3] > cover_a.root ? a.root[3] : cover_a.root;
  const double reach_b = b.root[3] > cover_b.root ? b.root[3] : cover_b.root;
  return sum + 2 * (reach_a + a_from_b.scale * reach_b);
}

/// How far rounding may move a distance within `length` (distance_error() of
/// query/base/precision.h).
template <class Real>
IST_HD double gap_error(double length) {
  return 12 * (sizeof(Real) == 4 ? 0x1p-24 : 0x1p-53) * length;
}

}  // namespace ist::gpu
