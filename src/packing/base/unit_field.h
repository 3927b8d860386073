#pragma once

#include <ist/solid.h>
#include <cmath>

namespace ist::packing {

/// A solid's signed distance in its unit frame, negative inside.
struct UnitField {
  const Solid& solid;
  UnitFrame frame;

  double value(const Eigen::Vector3d& x) const {
    return solid.signed_distance(frame.from_unit(x)) / frame.scale();
  }

  /// The surface point to which the gradient at x leads.
  Eigen::Vector3d foot(const Eigen::Vector3d& x, double value_of_x) const {
    constexpr double kStep = 0x1p-20;  // of central differences: float coordinates resolve it
    Eigen::Vector3d g;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d e = kStep * Eigen::Vector3d::Unit(k);
      g[k] = value(x + e) - value(x - e);
    }
    const double length = std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    return length > 0 ? Eigen::Vector3d(x - value_of_x / length * g) : x;
  }
};

}  // namespace ist::packing
