#pragma once

#include <cmath>

#include "mesh/triangle_frame.h"

namespace ist {

/// Tells which boxes a triangle meets, by separating axes; in double, rounding not included: ask
/// about boxes that are a little larger.
class CellOverlap {
 public:
  CellOverlap(const double a[3], const double b[3], const double c[3]) {
    for (int k = 0; k < 3; ++k) {
      corner_[0][k] = a[k];
      corner_[1][k] = b[k];
      corner_[2][k] = c[k];
    }
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) side_[i][k] = corner_[(i + 1) % 3][k] - corner_[i][k];
    cross3(side_[0], side_[1], normal_);
  }

  /// Whether the triangle and the box (centre, half-edges) have a point in common.
  bool meets(const double centre[3], const double half[3]) const {
    double p[3][3];
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) p[i][k] = corner_[i][k] - centre[k];
    for (int k = 0; k < 3; ++k)
      if (apart(p[0][k], p[1][k], p[2][k], half[k])) return false;
    const double off = dot3(normal_, p[0]);
    if (std::fabs(off) > std::fabs(normal_[0]) * half[0] + std::fabs(normal_[1]) * half[1] +
                             std::fabs(normal_[2]) * half[2])
      return false;
    for (const auto& e : side_)
      for (int k = 0; k < 3; ++k) {
        // The axis k × e: across both the side and an edge of the box.
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const double reach = std::fabs(e[j]) * half[i] + std::fabs(e[i]) * half[j];
        const auto along = [&](const double x[3]) { return e[i] * x[j] - e[j] * x[i]; };
        if (apart(along(p[0]), along(p[1]), along(p[2]), reach)) return false;
      }
    return true;
  }

 private:
  static bool apart(double a, double b, double c, double reach) {
    return (a > reach && b > reach && c > reach) || (a < -reach && b < -reach && c < -reach);
  }

  double corner_[3][3];
  double side_[3][3];
  double normal_[3];
};

}  // namespace ist
