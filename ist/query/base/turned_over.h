#pragma once

#include <span>

#include <ist/query.h>

#include "query/base/relative_pose.h"
#include "query/base/world_sums.h"

// turn_over() makes gradients by motions of one solid, which is at `moved`, about its origin those
// by motions of the other solid, at `other`, about its own.

namespace ist {

/// `answer`: with a force and a torque, as Penetration and ContactPatch.
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
