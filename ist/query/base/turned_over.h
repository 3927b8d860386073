#pragma once

#include <Eigen/Geometry>
#include <span>

#include <ist/query.h>

// Answers about a motion of one solid about its origin, as answers about a motion of the other
// about its own. `between`: [u] from the other's origin to the first one's, world.

namespace ist {

inline void turn_over(const Eigen::Vector3d& between, Penetration& answer) noexcept {
  answer.rotation_gradient =
      -(answer.rotation_gradient + between.cross(answer.translation_gradient));
  answer.translation_gradient = -answer.translation_gradient;
}

inline void turn_over(const Eigen::Vector3d& between, std::span<ContactPatch> patches) noexcept {
  for (ContactPatch& patch : patches) {
    patch.normal = -patch.normal;
    patch.torque = -(patch.torque + between.cross(patch.force));
    patch.force = -patch.force;
  }
}

}  // namespace ist
