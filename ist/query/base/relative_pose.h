#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

#include <ist/query.h>

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

}  // namespace ist
