#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "query/asset/shared_constants.h"
#include "query/ball_triangle/patch_sums.h"
#include "query/kernel/overlap.h"

namespace ist {

/// Sums over the parts of balls inside a shape, in its frame; positions are relative to the probing
/// tree's unit-frame origin.
struct ProbeTotal {
  Overlap overlap;     ///< its error is left to the descent
  double area = 0;     ///< of the shape's surface inside the balls
  double crossed = 0;  ///< volume of the balls that the surface crosses

  void add(const ProbeTotal& other) noexcept {
    overlap.add(other.overlap);
    area += other.area;
    crossed += other.crossed;
  }
};

/// Adds a ball's part: its volume, the gradient by its centre and the first moment about that, the
/// centre being at `x` from the probing tree's origin.
inline void add_part(const Eigen::Vector3d& x, double volume, const Eigen::Vector3d& gradient,
                     const Eigen::Vector3d& moment, Overlap& sum) noexcept {
  sum.volume += volume;
  sum.force += gradient;
  sum.torque += x.cross(gradient);
  sum.moment += volume * x + moment;
}

/// The balls whose centre's side the surface inside them tells, a bit each: the share of the sphere
/// that is inside the solid is [centre inside] + angle / 4π, and within 0 and 1.
inline std::uint32_t told_sides(const ProbeSums& sums, std::uint32_t& inside) noexcept {
  std::uint32_t told = 0;
  inside = 0;
  for (std::uint32_t left = sums.met; left != 0; left &= left - 1) {
    const auto i = static_cast<std::uint32_t>(std::countr_zero(left));
    if (!(std::abs(sums.angle[i]) > kLeastAngle)) continue;
    told |= 1u << i;
    inside |= sums.angle[i] < 0 ? 1u << i : 0u;
  }
  return told;
}

/// Sides as the surface inside the balls tells them, and as they are told otherwise.
inline std::uint32_t settled_sides(const ProbeSums& sums, std::uint32_t otherwise) noexcept {
  std::uint32_t inside;
  const std::uint32_t told = told_sides(sums, inside);
  return inside | (otherwise & ~told);
}

/// The sums of a block of balls once every triangle that reaches them is added. `inside`: whose
/// centres are, a bit each. `origin`: of the probing tree.
inline ProbeTotal total_of(const ProbeBalls& balls, const ProbeSums& sums, std::uint32_t inside,
                           const double (&origin)[3]) noexcept {
  ProbeTotal total;
  for (std::uint32_t bits = inside | sums.met; bits != 0; bits &= bits - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(bits));
    const double r = balls.r[i];
    const double whole = ball_volume(r);
    const double held = (inside >> i & 1) != 0 ? whole : 0;
    const Eigen::Vector3d x(balls.origin[0] + balls.x[i] - origin[0],
                            balls.origin[1] + balls.y[i] - origin[1],
                            balls.origin[2] + balls.z[i] - origin[2]);
    if ((sums.met >> i & 1) == 0) {
      total.overlap.volume += held;
      total.overlap.moment += held * x;
      continue;
    }
    const double volume = std::clamp(held + sums.cones[i], 0.0, whole);
    add_part(x, volume, -Eigen::Vector3d(sums.pull[0][i], sums.pull[1][i], sums.pull[2][i]),
             -Eigen::Vector3d(sums.shift[0][i], sums.shift[1][i], sums.shift[2][i]), total.overlap);
    total.area += sums.area[i];
    total.crossed += whole;
  }
  return total;
}

}  // namespace ist
