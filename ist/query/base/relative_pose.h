#pragma once

#include <ist/query.h>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>

#include "query/base/pair_place.h"

namespace ist {

inline Eigen::Vector3d vector(const double (&v)[3]) noexcept { return {v[0], v[1], v[2]}; }
template <class Point>
Eigen::Vector3d vector(const Point& p) noexcept {
  return {p.x, p.y, p.z};
}
inline Vec3 plain(const Eigen::Vector3d& v) noexcept { return {v.x(), v.y(), v.z()}; }

inline Eigen::Vector3d mapped(const Similarity& map, const double (&x)[3]) noexcept {
  double y[3];
  map.apply(x, y);
  return vector(y);
}

/// PairPlace of two placed trees, or of a shape and a tree.
struct RelativePose : PairPlace {
  /// World from A.
  Eigen::Matrix3d rotation() const {
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rotation_a);
  }
  Eigen::Vector3d to_world(const Eigen::Vector3d& x_unit_a) const {
    return vector(PairPlace::to_world(plain(x_unit_a)));
  }
};

/// Normalised; empty if pose or scale is not usable (QueryStatus::invalid_input).
std::optional<Eigen::Quaterniond> usable_rotation(const Pose& pose, double scale) noexcept;

/// Normalised; NaN if the quaternion is not usable.
inline Eigen::Quaterniond unit_rotation(const Pose& pose) noexcept {
  const Rotation r = Rotation::of(pose.q);
  return {r.w, r.v.x, r.v.y, r.v.z};
}

/// Empty if a pose or scale is not usable (QueryStatus::invalid_input) or a tree is empty.
std::optional<RelativePose> relative_pose(const PlacedAsset& a, const PlacedAsset& b) noexcept;

/// The same for a shape A, whose unit frame is its own frame.
std::optional<RelativePose> relative_pose(const Pose& a, double scale_a,
                                          const PlacedAsset& b) noexcept;

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
