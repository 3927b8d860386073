#pragma once

#include "query/base/pair_place.h"

namespace ist {

/// The gradient by rotations of A about another origin. `arm`: [u] from that origin to this.
IST_HD inline Vec3 turned_over(const Vec3& arm, const Vec3& push, const Vec3& turn) noexcept {
  return -(turn + cross(arm, push));
}

/// An overlap or a part of it in world units.
struct WorldSums {
  double volume;
  Vec3 centroid;              ///< zero without volume
  Vec3 translation_gradient;  ///< by a motion of B
  Vec3 rotation_gradient;     ///< likewise, about B's origin

  /// From sums in A's unit frame (Overlap, query/kernel/overlap.h).
  IST_HD static WorldSums of(const PairPlace& place, double volume, const Vec3& force,
                             const Vec3& torque, const Vec3& moment) noexcept {
    const double unit = place.unit_a, unit3 = unit * unit * unit;
    WorldSums sums = {unit3 * volume, {0, 0, 0}, turned(unit * unit, place.rotation_a, force), {}};
    if (volume > 0) sums.centroid = place.to_world(moment / volume + vec3(place.a_from_b.t));
    sums.rotation_gradient =
        turned(unit3, place.rotation_a, torque) + cross(place.offset_b, sums.translation_gradient);
    return sums;
  }
};

}  // namespace ist
