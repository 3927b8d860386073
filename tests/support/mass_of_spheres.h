#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "bake/asset/asset_writer.h"

namespace ist::testing {

/// Mass properties and bounds for an asset without a solid: those of its matched spheres.
inline void describe_spheres(AssetArrays& arrays) {
  using Eigen::Vector3d;
  AssetHeader& header = arrays.header;
  const Vector3d origin(header.centre);
  const double unit = std::ldexp(1.0, header.exponent);
  const auto centre = [](const Sphere& s) { return Vector3d(s.x, s.y, s.z); };
  const auto volume = [](const Sphere& s) { return 4.18879020478639 * s.r * s.r * s.r; };
  double sum = 0;
  Vector3d mass = Vector3d::Zero(), lower = Vector3d::Constant(1e9), upper = -lower;
  for (const Sphere& s : arrays.matched_spheres) {
    sum += volume(s);
    mass += volume(s) * centre(s);
    lower = lower.cwiseMin(centre(s) - Vector3d::Constant(s.r));
    upper = upper.cwiseMax(centre(s) + Vector3d::Constant(s.r));
  }
  mass /= sum;
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  double radius = 0;
  const Vector3d middle = (lower + upper) / 2;
  for (const Sphere& s : arrays.matched_spheres) {
    const Vector3d y = centre(s) - mass;
    inertia +=
        volume(s) * ((y.squaredNorm() + 0.4 * double{s.r} * s.r) * Eigen::Matrix3d::Identity() -
                     y * y.transpose());
    radius = std::max(radius, (centre(s) - middle).norm() + s.r);
  }
  for (int k = 0; k < 3; ++k) {
    header.centre_of_mass[k] = mass[k];
    header.inertia[k] = inertia(k, k);
    header.inertia[3 + k] = k < 2 ? inertia(0, k + 1) : inertia(1, 2);
    header.box_lower[k] = origin[k] + unit * lower[k];
    header.box_upper[k] = origin[k] + unit * upper[k];
    header.ball_centre[k] = origin[k] + unit * middle[k];
  }
  header.ball_radius = unit * radius;
}

}  // namespace ist::testing
