#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "base/elementary.h"
#include "base/raw_array.h"
#include "mesh/connectivity/edge_table.h"

namespace ist {

using FloatPoint = std::array<float, 3>;

/// Bounds the triangles under a node if there are large fans or other needles: their triangles are
/// long and thin, and their boxes overlap nearly all others.
struct Slab {
  std::uint32_t owner = kNoIndex;  ///< the vertex shared by all triangles, if it has many
  bool spread = false;             ///< its fan is spread: no two of its triangles meet
  Eigen::Vector3d direction;       ///< the axis of a cone from the owner around them
  double angle = 0;                ///< [rad] half the opening of the cone
  Eigen::Vector3d centre;          ///< of a box around them
  Eigen::Matrix3d axes;            ///< its axes, in columns
  Eigen::Vector3d half;            ///< and half extents

  /// True if the groups lie in different directions from their common vertex, or are known not to
  /// meet.
  bool apart_about_owner(const Slab& other) const {
    if (owner != other.owner || owner == kNoIndex) return false;
    constexpr double kRounding = 2.5e-4;  // of directions to points rounded to float
    return spread || angle_of(direction.cross(other.direction).norm(),
                              direction.dot(other.direction)) > angle + other.angle + kRounding;
  }

  /// True if a plane along a side of either box, or along an edge of both, separates them.
  bool apart_from(const Slab& other) const {
    constexpr double kRounding = 1e-6;  // exceeds that of coordinates within [0, 1] in float
    const Eigen::Vector3d between = other.centre - centre;
    const Eigen::Vector3d off = axes.transpose() * between;
    const Eigen::Matrix3d turn = axes.transpose() * other.axes, size = turn.cwiseAbs();
    if (((off.cwiseAbs() - half - size * other.half).array() > kRounding).any() ||
        (((other.axes.transpose() * between).cwiseAbs() - other.half - size.transpose() * half)
             .array() > kRounding)
            .any())
      return true;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
        const double reach = half[i1] * size(i2, j) + half[i2] * size(i1, j) +
                             other.half[j1] * size(i, j2) + other.half[j2] * size(i, j1);
        if (std::abs(off[i2] * turn(i1, j) - off[i1] * turn(i2, j)) - reach > kRounding)
          return true;
      }
    return false;
  }
};

/// The corners of up to eight triangles, and two of their planes that have all of them behind:
/// those that bound them most tightly. Adjacent needles, like the walls of a star, lie between such
/// planes like a slice of a cake, while boxes of slices meet near the tip.
struct Slice {
  static constexpr std::size_t kCorners = 24;
  float corner[3][kCorners];  ///< in [0, 1]
  float normal[2][3], reach[2];

  /// True if one of either's planes has the other in front of it.
  bool apart_from(const Slice& other) const { return other.is_before(*this) || is_before(other); }

 private:
  bool is_before(const Slice& other) const {
    constexpr float kRounding = 1e-6f;  // of coordinates within [0, 1], and of their products
    for (int i = 0; i < 2; ++i) {
      const float* const n = other.normal[i];
      float least = HUGE_VALF;
      for (std::size_t k = 0; k < kCorners; ++k)
        least = std::min(least, n[0] * corner[0][k] + n[1] * corner[1][k] + n[2] * corner[2][k]);
      if (least > other.reach[i] + kRounding) return true;
    }
    return false;
  }
};

/// [triangle] The corner with the most triangles, if these are many; empty if no corner has many.
std::vector<std::uint32_t> owners_of(const std::vector<Triangle>& triangles, std::size_t vertices);

/// A box around a group of triangles, with one axis along their longest side and one along their
/// normal. `points`: vertices, in [0, 1]. `margin`: by which one of two boxes is enlarged.
Slab slab_of(const RawArray<FloatPoint>& points, const std::vector<Triangle>& triangles,
             std::span<const std::uint32_t> group, const std::vector<std::uint32_t>& owners,
             const std::vector<std::uint32_t>& spread, double margin);

/// `group`: one to eight triangles. Planes are moved out by `margin`.
Slice slice_of(const RawArray<FloatPoint>& points, const std::vector<Triangle>& triangles,
               std::span<const std::uint32_t> group, double margin);

}  // namespace ist
