#include "query/unresolved.h"

#include <algorithm>
#include <cmath>

#include "query/lens.h"

namespace ist {

PairEstimate estimate_pair(const SphereTree& a, int level_a, std::uint32_t block_a,
                           const SphereTree& b, int level_b, std::uint32_t block_b,
                           const Similarity& a_from_b) noexcept {
  const NodeBall ball_a = a.ball(level_a, block_a);
  const NodeBall ball_b = b.ball(level_b, block_b);
  const NodeSums sums_a = a.sums(level_a, block_a);
  const NodeSums sums_b = b.sums(level_b, block_b);
  double moved[3];
  a_from_b.apply(ball_b.centre, moved);
  const Eigen::Vector3d centre_a(ball_a.centre[0], ball_a.centre[1], ball_a.centre[2]);
  const Eigen::Vector3d centre_b(moved[0], moved[1], moved[2]);
  const double radius_b = ball_b.r * a_from_b.scale;
  const double volume_b = sums_b.volume * (a_from_b.scale * a_from_b.scale * a_from_b.scale);
  const Eigen::Vector3d between = centre_b - centre_a;
  const double d = between.norm();

  // Rounding of the centres must not let a touching pair pass for a separate one.
  const double rounding = 1e-14 * (centre_a.norm() + centre_b.norm() + ball_a.r + radius_b);
  const Lens<double> outer = lens(ball_a.r + rounding, radius_b + rounding, d);
  PairEstimate result;
  // Every point of the overlap lies in at most κ spheres of either tree, and in both balls.
  result.bound = (1 + 1e-9) * std::min({sums_b.overlap * sums_a.volume, sums_a.overlap * volume_b,
                                        sums_a.overlap * sums_b.overlap * outer.volume()});

  const Lens<double> inner = lens(ball_a.r, radius_b, d);
  const double overlap = inner.volume();
  if (!(overlap > 0)) return result;
  const double ball_volume = 4 * M_PI / 3;
  const double density_a = sums_a.volume / (ball_volume * ball_a.r * ball_a.r * ball_a.r);
  const double density_b = volume_b / (ball_volume * radius_b * radius_b * radius_b);
  const double guess = density_a * density_b * overlap;
  result.volume = std::min(guess, result.bound);
  const double share = result.volume / overlap;
  if (d > 0) result.force = share * inner.derivative() / d * between;
  result.centre = (inner.cap_a * centre_a + inner.cap_b * centre_b) / (inner.cap_a + inner.cap_b);
  return result;
}

}  // namespace ist
