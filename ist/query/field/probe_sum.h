#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "query/asset/sphere_tree.h"
#include "query/base/relative_pose.h"
#include "query/kernel/overlap.h"
#include "query/probe/surface_patch.h"

namespace ist {

/// The spheres of a leaf block, placed in a field's frame around the centre of the leaf ball.
inline void place_probes(const SphereTree& probes, std::uint32_t block, const Similarity& map,
                         ProbeBalls& balls) noexcept {
  const NodeBall ball = probes.ball(0, block);
  const BallBlock& from = probes.level[0].blocks[block];
  const Origin& o = probes.level[0].origins[block];
  map.apply(ball.centre, balls.origin);
  const double x0 = o.x - ball.centre[0], y0 = o.y - ball.centre[1], z0 = o.z - ball.centre[2];
  const double* const m = map.m;
  for (std::size_t lane = 0; lane < kWidth; ++lane) {
    const double x = x0 + static_cast<double>(from.x[lane]);
    const double y = y0 + static_cast<double>(from.y[lane]);
    const double z = z0 + static_cast<double>(from.z[lane]);
    balls.x[lane] = (m[0] * x + m[1] * y) + m[2] * z;
    balls.y[lane] = (m[3] * x + m[4] * y) + m[5] * z;
    balls.z[lane] = (m[6] * x + m[7] * y) + m[8] * z;
    balls.r[lane] = std::max(static_cast<double>(from.r[lane]), 0.0) * map.scale;
  }
  balls.reach = ball.r * map.scale * (1 + 1e-12);
}

/// What the parts of balls inside a field add up to, in its frame; positions are relative to the
/// probing tree's unit-frame origin.
struct ProbeTotal {
  Overlap overlap;     ///< its error is left to the descent
  double area = 0;     ///< of the field's surface inside the balls
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

/// Solid angles smaller than this do not tell on which side a centre is.
inline constexpr double kLeastAngle = 1e-6;

/// The sums of a block of balls once every triangle that reaches them is added. `origin`: of the
/// probing tree. `inside(x)`: asked of balls that no triangle meets or whose triangles do not tell.
///
/// The solid angle of the surface inside a ball tells where the centre is: the share of the sphere
/// that is inside the solid is [centre inside] + angle / 4π, and within 0 and 1.
template <class Inside>
ProbeTotal total_of(const ProbeBalls& balls, const ProbeSums& sums, const double (&origin)[3],
                    const Inside& inside) noexcept {
  ProbeTotal total;
  for (std::size_t i = 0; i < kWidth; ++i) {
    const double r = balls.r[i];
    if (!(r > 0)) continue;
    const double whole = 4 * std::numbers::pi / 3 * (r * r * r);
    const double at[3] = {balls.origin[0] + balls.x[i], balls.origin[1] + balls.y[i],
                          balls.origin[2] + balls.z[i]};
    const bool tells = std::abs(sums.angle[i]) > kLeastAngle;
    const bool held = tells ? sums.angle[i] < 0 : inside(at);
    const bool met = (sums.met >> i & 1) != 0;
    if (!held && !met) continue;
    const Eigen::Vector3d x(at[0] - origin[0], at[1] - origin[1], at[2] - origin[2]);
    if (!met) {
      total.overlap.volume += whole;
      total.overlap.moment += whole * x;
      continue;
    }
    const double volume = std::clamp((held ? whole : 0) + sums.cones[i], 0.0, whole);
    add_part(x, volume, -Eigen::Vector3d(sums.pull[0][i], sums.pull[1][i], sums.pull[2][i]),
             -Eigen::Vector3d(sums.shift[0][i], sums.shift[1][i], sums.shift[2][i]),
             total.overlap);
    total.area += sums.area[i];
    total.crossed += whole;
  }
  return total;
}

}  // namespace ist
