#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

#include <ist/query.h>

namespace ist {

inline Eigen::Vector3d vector(const double (&v)[3]) noexcept { return {v[0], v[1], v[2]}; }
template <class Point>
Eigen::Vector3d vector(const Point& p) noexcept {
  return {p.x, p.y, p.z};
}

/// x ↦ scale · R x + t with the matrix stored scaled: plain numbers, because SIMD code reads them.
struct Similarity {
  double m[9] = {};  ///< scale · R, row by row
  double t[3] = {};
  double scale = 1;

  static Similarity identity() noexcept { return {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {}, 1}; }

  void apply(const double (&x)[3], double (&y)[3]) const {
    for (int i = 0; i < 3; ++i)
      y[i] = (m[3 * i] * x[0] + m[3 * i + 1] * x[1]) + m[3 * i + 2] * x[2] + t[i];
  }
};

/// Two placed trees, seen from A's unit frame (docs/design.md 3.4): poses, scales and both unit
/// frames are folded into one map, in double.
struct RelativePose {
  Similarity a_from_b;  ///< unit frame of B → unit frame of A
  Similarity b_from_a;
  Eigen::Matrix3d rotation_a;     ///< world from A
  Eigen::Vector3d unit_origin_a;  ///< [u] world position of A's unit-frame origin
  Eigen::Vector3d unit_offset_b;  ///< [u] from B's origin to its unit-frame origin, world
  double unit_a = 1;              ///< [u] length of one unit of A's unit frame

  Eigen::Vector3d to_world(const Eigen::Vector3d& x_unit_a) const {
    return rotation_a * (x_unit_a * unit_a) + unit_origin_a;
  }
};

/// How a number grows with motions of B, A's unit frame.
struct PoseSlope {
  Eigen::Vector3d by_translation = Eigen::Vector3d::Zero();
  Eigen::Vector3d by_rotation = Eigen::Vector3d::Zero();  ///< about B's unit-frame origin
};

/// Normalised; empty if pose or scale is not usable (QueryStatus::invalid_input).
std::optional<Eigen::Quaterniond> usable_rotation(const Pose& pose, double scale) noexcept;

/// Empty if a pose or scale is not usable (QueryStatus::invalid_input) or a tree is empty.
std::optional<RelativePose> relative_pose(const PlacedTree& a, const PlacedTree& b) noexcept;

/// The same where A is no tree: its unit frame is its own.
std::optional<RelativePose> relative_pose(const Pose& a, double scale_a,
                                          const PlacedTree& b) noexcept;

}  // namespace ist
