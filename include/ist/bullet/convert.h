#pragma once

#include <LinearMath/btTransform.h>

#include <Eigen/Geometry>

#include <ist/types.h>

// Conversions between Bullet's types, of either precision, and those of Eigen and ist.

namespace ist::bullet {

inline btVector3 to_bullet(const Eigen::Vector3d& v) {
  return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}
inline Eigen::Vector3d to_eigen(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

inline btTransform to_bullet(const Eigen::Isometry3d& x) {
  const Eigen::Quaternion<btScalar> q(Eigen::Quaterniond(x.rotation()).cast<btScalar>());
  return btTransform(btQuaternion(q.x(), q.y(), q.z(), q.w()),
                     to_bullet(Eigen::Vector3d(x.translation())));
}
inline Eigen::Isometry3d to_eigen(const btTransform& x) {
  const btQuaternion q = x.getRotation();
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.linear() = Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()).toRotationMatrix();
  out.translation() = to_eigen(x.getOrigin());
  return out;
}

inline Pose to_pose(const btTransform& x) {
  const btQuaternion q = x.getRotation();
  const btVector3& t = x.getOrigin();
  return {{q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}};
}

}  // namespace ist::bullet
