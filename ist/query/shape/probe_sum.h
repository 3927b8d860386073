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

/// Sums over the parts of balls inside a shape, relative to the probing tree's unit-frame origin.
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

/// Adds a ball's part. `x`: the centre, which `gradient` and `moment` are by and about.
inline void add_part(const Eigen::Vector3d& x, double volume, const Eigen::Vector3d& gradient,
                     const Eigen::Vector3d& moment, Overlap& sum) noexcept {
  sum.volume += volume;
  sum.force += gradient;
  sum.torque += x.cross(gradient);
  sum.moment += volume * x + moment;
}

/// A bit for each ball with its centre inside. The surface inside a ball decides where its solid
/// angle is not 0, as the share of the sphere inside the solid, [centre inside] + angle / 4π, is in
/// [0, 1]; elsewhere `inside` does.
inline std::uint32_t sides_by_angles(const ProbeSums& sums, std::uint32_t inside) noexcept {
  for (std::uint32_t left = sums.met; left != 0; left &= left - 1) {
    const auto i = static_cast<std::uint32_t>(std::countr_zero(left));
    if (!(std::abs(sums.angle[i]) > kLeastAngle)) continue;
    inside = sums.angle[i] < 0 ? inside | 1u << i : inside & ~(1u << i);
  }
  return inside;
}

/// The sums of a block of balls once every triangle that reaches them is added. `inside`: a bit for
/// each centre inside. `origin`: of the probing tree.
inline ProbeTotal total_of(const ProbeBalls& balls, const ProbeSums& sums, std::uint32_t inside,
                           const double (&origin)[3]) noexcept {
  ProbeTotal total;
  for (std::uint32_t bits = inside | sums.met; bits != 0; bits &= bits - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(bits));
    const double r = balls.r[i];
    const double whole = ball_volume(r);
    const double contained = (inside >> i & 1) != 0 ? whole : 0;
    const Eigen::Vector3d x = balls.centre(i) - vector(origin);
    if ((sums.met >> i & 1) == 0) {
      total.overlap.volume += contained;
      total.overlap.moment += contained * x;
      continue;
    }
    const double volume = std::clamp(contained + sums.cones[i], 0.0, whole);
    add_part(x, volume, -Eigen::Vector3d(sums.pull[0][i], sums.pull[1][i], sums.pull[2][i]),
             -Eigen::Vector3d(sums.shift[0][i], sums.shift[1][i], sums.shift[2][i]), total.overlap);
    total.area += sums.area[i];
    total.crossed += whole;
  }
  return total;
}

}  // namespace ist
