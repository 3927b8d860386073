#pragma once

#include <span>

#include <ist/query.h>

#include "query/base/relative_pose.h"
#include "query/base/world_sums.h"

// Answers about a motion of one solid, which is at `moved`, about its origin, as answers about a
// motion of the other, at `other`, about its own.

namespace ist {

/// [u] From the other's origin to the first one's, world.
inline Vec3 arm_between(const Pose& moved, const Pose& other) noexcept {
  return vec3(moved.t) - vec3(other.t);
}

inline void turn_over(const Pose& moved, const Pose& other, Penetration& answer) noexcept {
  Eigen::Vector3d &push = answer.force, &turn = answer.torque;
  turn = vector(turned_over(arm_between(moved, other), plain(push), plain(turn)));
  push = -push;
}

inline void turn_over(const Pose& moved, const Pose& other,
                      std::span<ContactPatch> patches) noexcept {
  const Vec3 arm = arm_between(moved, other);
  for (ContactPatch& patch : patches) {
    patch.normal = -patch.normal;
    patch.torque = vector(turned_over(arm, plain(patch.force), plain(patch.torque)));
    patch.force = -patch.force;
  }
}

}  // namespace ist
