#pragma once

#include "query/base/pair_place.h"

namespace ist {

/// Sums of an overlap or a part of it in world units, on the host and on a GPU.
struct ExactInWorld {
  double volume;
  Vec3 centroid;       ///< zero if there is no volume
  Vec3 force, torque;  ///< the volume's gradients by a motion of B, about B's origin

  /// Converts sums in A's unit frame about `origin`. `moment`: 24 ∫ x.
  IST_HD ExactInWorld(double found, const Vec3& moment, const Vec3& push, const Vec3& turn,
                      const Vec3& origin, const PairPlace& place) {
    const double u = place.unit_a, unit3 = u * u * u;
    volume = found * unit3;
    force = (u * u) * turned(place.rotation_a, push);
    centroid = {0, 0, 0};
    if (found != 0) centroid = place.to_world(origin + moment / (24 * found));
    // The sums' origin relative to B's.
    const Vec3 arm =
        turned(place.rotation_a, u * (origin - vec3(place.a_from_b.t))) + place.offset_b;
    torque = unit3 * turned(place.rotation_a, turn) + cross(arm, force);
  }
};

}  // namespace ist
