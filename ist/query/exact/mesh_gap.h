#pragma once

#include <cmath>
#include <cstdint>

#include "query/base/pair_place.h"
#include "query/exact/mesh_tree.h"

// Bounds and roundings of the distance of two meshes, on the CPU and on a GPU.

namespace ist {

/// A bound of the coordinates of two placed meshes and of their differences, A's unit frame.
IST_HD inline double reach_of(const MeshTree& a, const MeshTree& b, const Similarity& a_from_b) {
  const double(&t)[3] = a_from_b.t;
  const double shift = std::fmax(std::abs(t[0]), std::fmax(std::abs(t[1]), std::abs(t[2])));
  return a.extent() + a_from_b.scale * b.extent() + shift;
}
/// True if floats can distinguish boxes of both solids: neither is too small relative to the reach.
IST_HD inline bool floats_tell(const MeshTree& a, const MeshTree& b, double scale, double reach) {
  constexpr double kLost = 1e-3;
  return kLost * reach < std::fmin(a.extent(), scale * b.extent());
}
// The rounding for coordinates within `reach`: of any triangles' distance, of the least distance,
// and of boxes in float.
IST_HD constexpr double gap_slack(double reach) { return 1e-14 * reach; }
IST_HD constexpr double gap_rounding(double reach) { return 4e-15 * reach; }
IST_HD constexpr double float_gap_blur(double reach) { return 2e-6 * reach; }
/// The error of two meshes' distance relative to that of their solids, A's unit frame. `moved`: the
/// rounding of poses.
IST_HD inline double gap_error(const MeshTree& a, const MeshTree& b, const PairPlace& pose,
                               double moved) {
  const double scale = pose.a_from_b.scale;
  return (a.header->error + scale * b.header->error) + a.header->rounding +
         scale * b.header->rounding + moved + pose.rounding_of_world();
}
/// For a larger B the fourth powers of lengths would overflow, so A is mapped to its frame instead.
inline constexpr double kLargestGapScale = 1e30;
/// Pairs of solids that are far apart for their size are equally near within this relative
/// rounding, so any pair may answer.
inline constexpr double kGapsAlike = 1e-13;
/// If faces are parallel, the direction between them is their normal, which a short difference
/// gives with few digits. True if the direction is the normal of triangle t; then `level` is that
/// normal, from A to B.
IST_HD inline bool level_with(const exact::Point (&t)[3], const exact::Point& direction,
                              exact::Point& level) {
  const exact::Point n = cross(t[1] - t[0], t[2] - t[0]);
  const double length = std::sqrt(dot(n, n)), along = dot(n, direction);
  constexpr double kLevel = 1 - 1e-10;
  if (!(length > 0 && std::abs(along) > kLevel * length)) return false;
  level = ((along > 0 ? 1 : -1) / length) * n;
  return true;
}

/// The number of node pairs of spheres that are opened for a bound. More gain little.
inline constexpr std::uint32_t kGlance = 64;

/// The nearest two triangles so far; among those that are equally near up to rounding, the ones
/// with the lowest numbers.
struct NearestTriangles {
  static constexpr std::uint64_t kNone = ~std::uint64_t{0};

  double rounding;                            ///< of a distance
  double least = HUGE_VAL, alike = HUGE_VAL;  ///< squared; up to `alike` all count as equal
  double squared = HUGE_VAL;
  std::uint64_t pair = kNone;            ///< A's << 32 | B's
  exact::Point on_a = {}, between = {};  ///< from there to B's

  IST_HD void meet(double found) {
    if (!(found < least)) return;
    least = found;
    alike = (std::sqrt(least) + rounding) * (std::sqrt(least) + rounding);
  }
  /// True if this pair replaces the answer.
  IST_HD bool wants(double found, std::uint64_t name) const {
    return found <= alike && !(squared <= alike && pair < name);
  }
  IST_HD void set(double found, std::uint64_t name, const exact::Point& at,
                  const exact::Point& vector) {
    squared = found;
    pair = name;
    on_a = at;
    between = vector;
  }
};

}  // namespace ist
