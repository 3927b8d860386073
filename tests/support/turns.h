#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

namespace ist::testing {

/// [degrees] Between two directions of any length above 0.
inline double degrees_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

/// A rotation, each as likely as any other.
inline Eigen::Quaterniond random_turn(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double w = normal(random), x = normal(random), y = normal(random), z = normal(random);
  return Eigen::Quaterniond(w, x, y, z).normalized();
}

}  // namespace ist::testing
