#pragma once

#include <Eigen/Geometry>
#include <span>

#include <ist/query.h>

// Answers about a motion of one solid, which is at `moved`, about its origin, as answers about a
// motion of the other, at `other`, about its own.

namespace ist {

/// [u] From the other's origin to the first one's, world.
inline Eigen::Vector3d arm_between(const Pose& moved, const Pose& other) noexcept {
  return {moved.t[0] - other.t[0], moved.t[1] - other.t[1], moved.t[2] - other.t[2]};
}

inline void turn_over(const Pose& moved, const Pose& other, Penetration& answer) noexcept {
  const Eigen::Vector3d arm = arm_between(moved, other);
  answer.rotation_gradient = -(answer.rotation_gradient + arm.cross(answer.translation_gradient));
  answer.translation_gradient = -answer.translation_gradient;
}

inline void turn_over(const Pose& moved, const Pose& other,
                      std::span<ContactPatch> patches) noexcept {
  const Eigen::Vector3d arm = arm_between(moved, other);
  for (ContactPatch& patch : patches) {
    patch.normal = -patch.normal;
    patch.torque = -(patch.torque + arm.cross(patch.force));
    patch.force = -patch.force;
  }
}

}  // namespace ist
