#pragma once

#include <cmath>
#include <cstdint>

#include "query/base/pair_place.h"
#include "query/exact/mesh_tree.h"

// What the distance of two meshes is told by, on the CPU and on a GPU.

namespace ist {

/// No coordinate of two placed meshes is larger, nor a difference of two; A's unit frame.
IST_HD inline double reach_of(const MeshTree& a, const MeshTree& b, const Similarity& a_from_b) {
  const double(&t)[3] = a_from_b.t;
  const double shift = std::fmax(std::abs(t[0]), std::fmax(std::abs(t[1]), std::abs(t[2])));
  return a.extent() + a_from_b.scale * b.extent() + shift;
}
/// Floats tell boxes of both solids apart as long as neither is so small in what is between them.
IST_HD inline bool floats_tell(const MeshTree& a, const MeshTree& b, double scale, double reach) {
  constexpr double kLost = 1e-3;
  return kLost * reach < std::fmin(a.extent(), scale * b.extent());
}
// What rounding does where coordinates reach so far: to distances of triangles at most; to those
// that are the least; to boxes in floats.
IST_HD constexpr double gap_slack(double reach) { return 1e-14 * reach; }
IST_HD constexpr double gap_rounding(double reach) { return 4e-15 * reach; }
IST_HD constexpr double float_gap_blur(double reach) { return 2e-6 * reach; }
/// What the distance of two meshes may be off by from that of their solids: A's unit frame.
/// `moved`: by poses.
IST_HD inline double gap_error(const MeshTree& a, const MeshTree& b, const PairPlace& pose,
                               double moved) {
  const double scale = pose.a_from_b.scale;
  return (a.header->error + scale * b.header->error) + a.header->rounding +
         scale * b.header->rounding + moved + pose.rounding_of_world();
}
/// Of a larger B the fourth powers of lengths would overflow: A is moved into its frame instead.
inline constexpr double kLargestGapScale = 1e30;
/// Of solids that are far apart for their size all is as near, to rounding: one pair will do.
inline constexpr double kGapsAlike = 1e-13;
/// The way between level faces is their normal: a short way has few digits of it. Whether it is
/// that of a triangle, and then the normal from A to B.
IST_HD inline bool level_with(const exact::Point (&t)[3], const exact::Point& way,
                              exact::Point& level) {
  const exact::Point n = cross(t[1] - t[0], t[2] - t[0]);
  const double length = std::sqrt(dot(n, n)), along = dot(n, way);
  constexpr double kLevel = 1 - 1e-10;
  if (!(length > 0 && std::abs(along) > kLevel * length)) return false;
  level = ((along > 0 ? 1 : -1) / length) * n;
  return true;
}

/// Node pairs of spheres that are opened for a bound: more of them bring little.
inline constexpr std::uint32_t kGlance = 64;

/// The nearest two triangles so far; of those that are as near, to rounding, the ones of the lowest
/// numbers.
struct NearestTriangles {
  static constexpr std::uint64_t kNone = ~std::uint64_t{0};

  double rounding;                            ///< of a distance
  double least = HUGE_VAL, alike = HUGE_VAL;  ///< squared; up to there all is as near as the least
  double squared = HUGE_VAL;
  std::uint64_t pair = kNone;            ///< A's << 32 | B's
  exact::Point on_a = {}, between = {};  ///< from there to B's

  IST_HD void meet(double found) {
    if (!(found < least)) return;
    least = found;
    alike = (std::sqrt(least) + rounding) * (std::sqrt(least) + rounding);
  }
  /// Of a pair that was met, whether it answers now.
  IST_HD bool wants(double found, std::uint64_t name) const {
    return found <= alike && !(squared <= alike && pair < name);
  }
  IST_HD void set(double found, std::uint64_t name, const exact::Point& at,
                  const exact::Point& way) {
    squared = found;
    pair = name;
    on_a = at;
    between = way;
  }
};

}  // namespace ist
