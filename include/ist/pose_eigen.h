#pragma once

#include <Eigen/Geometry>

#include <ist/types.h>

namespace IST_API ist {

/// Pose of a rigid Eigen transform; `x` must be a rotation and a translation (no scale or shear).
inline Pose to_pose(const Eigen::Isometry3d& x) {
  const Eigen::Quaterniond q(x.rotation());
  return {{q.w(), q.x(), q.y(), q.z()},
          {x.translation().x(), x.translation().y(), x.translation().z()}};
}

inline Eigen::Isometry3d to_isometry(const Pose& pose) {
  Eigen::Isometry3d x = Eigen::Isometry3d::Identity();
  x.linear() = Eigen::Quaterniond(pose.q[0], pose.q[1], pose.q[2], pose.q[3])
                   .normalized()
                   .toRotationMatrix();
  x.translation() = Eigen::Vector3d(pose.t[0], pose.t[1], pose.t[2]);
  return x;
}

}  // namespace ist
