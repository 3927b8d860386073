#pragma once

#include <span>

#include <ist/query.h>

#include "query/base/relative_pose.h"
#include "query/base/world_sums.h"

namespace ist {

/// Converts forces and torques on the solid at `moved` to those on the one at `other`.
template <class Answer>
void turn_over(const Pose& moved, const Pose& other, Answer& answer) noexcept {
  const Vec3 arm = vec3(moved.t) - vec3(other.t);
  answer.torque = vector(turned_over(arm, plain(answer.force), plain(answer.torque)));
  answer.force = -answer.force;
}

inline void turn_over(const Pose& moved, const Pose& other,
                      std::span<ContactPatch> patches) noexcept {
  for (ContactPatch& patch : patches) {
    patch.normal = -patch.normal;
    turn_over(moved, other, patch);
  }
}

}  // namespace ist
