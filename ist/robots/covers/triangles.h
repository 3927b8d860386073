#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "base/elementary.h"
#include "mesh/mesh_solid.h"

namespace ist {

/// The corners of a triangle that is divided recursively.
using HalvableTriangle = std::array<Eigen::Vector3d, 3>;

struct LongestSide {
  std::size_t from = 0;  ///< the side from this corner to the next
  double length2 = 0;
};

/// The first among several of equal length.
inline LongestSide longest_side(const HalvableTriangle& t) {
  LongestSide longest{0, -1};
  for (std::size_t k = 0; k < 3; ++k) {
    const double length2 = (t[(k + 1) % 3] - t[k]).squaredNorm();
    if (length2 > longest.length2) longest = {k, length2};
  }
  return longest;
}

/// A triangle cut from the middle of a side to the opposite corner, with the same orientation.
inline std::array<HalvableTriangle, 2> halves(const HalvableTriangle& t, std::size_t side) {
  const Eigen::Vector3d &a = t[side], &b = t[(side + 1) % 3], &c = t[(side + 2) % 3];
  const Eigen::Vector3d middle = (a + b) / 2;
  return {HalvableTriangle{middle, c, a}, HalvableTriangle{b, c, middle}};
}

/// The middle of one of the eight parts of a cube.
inline Eigen::Vector3d middle_of_part(const Eigen::Vector3d& middle, double half, int part) {
  const auto off = [&](int bit) { return (part & bit) != 0 ? half / 2 : -half / 2; };
  return middle + Eigen::Vector3d(off(1), off(2), off(4));
}

}  // namespace ist
