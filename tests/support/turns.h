#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <ist/types.h>

namespace ist::testing {

/// [degrees] Between two directions of any length above 0.
inline double degrees_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

/// The 24 rotations of the cube onto itself.
inline std::vector<Eigen::Quaterniond> right_angled_turns() {
  std::vector<Eigen::Quaterniond> turns;
  const double half = std::sqrt(0.5);
  for (int face = 0; face < 6; ++face) {
    // The z axis to a face, then a quarter turn about it as often as may be.
    const Eigen::Quaterniond there = face == 4   ? Eigen::Quaterniond(1, 0, 0, 0)
                                     : face == 5 ? Eigen::Quaterniond(0, 1, 0, 0)
                                     : face < 2
                                         ? Eigen::Quaterniond(half, 0, face ? half : -half, 0)
                                         : Eigen::Quaterniond(half, face - 2 ? half : -half, 0, 0);
    for (const auto& [w, z] : {std::pair{1.0, 0.0}, {half, half}, {0.0, 1.0}, {-half, half}})
      turns.push_back(there * Eigen::Quaterniond(w, 0, 0, z));
  }
  return turns;
}

/// `pose` after a turn of the world about its origin.
inline Pose turned(const Eigen::Quaterniond& turn, const Pose& pose) {
  const Eigen::Quaterniond q =
      turn * Eigen::Quaterniond(pose.q[0], pose.q[1], pose.q[2], pose.q[3]);
  const Eigen::Vector3d t = turn * Eigen::Vector3d(pose.t[0], pose.t[1], pose.t[2]);
  return {{q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}};
}

/// A rotation, each as likely as any other.
inline Eigen::Quaterniond random_turn(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double w = normal(random), x = normal(random), y = normal(random), z = normal(random);
  return Eigen::Quaterniond(w, x, y, z).normalized();
}

}  // namespace ist::testing
