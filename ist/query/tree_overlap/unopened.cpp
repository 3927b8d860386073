#include "query/tree_overlap/unopened.h"

#include <algorithm>

#include "query/kernel/lens.h"

namespace ist {

namespace {

/// Two nodes in A's unit frame.
struct Nodes {
  Nodes(const SphereTree& a, int level_a, std::uint32_t block_a, const SphereTree& b, int level_b,
        std::uint32_t block_b, const Similarity& a_from_b)
      : ball_a(a.ball(level_a, block_a)),
        sums_a(a.sums(level_a, block_a)),
        sums_b(b.sums(level_b, block_b)) {
    const NodeBall ball_b = b.ball(level_b, block_b);
    double moved[3];
    a_from_b.apply(ball_b.centre, moved);
    centre_a = Eigen::Vector3d(ball_a.centre[0], ball_a.centre[1], ball_a.centre[2]);
    centre_b = Eigen::Vector3d(moved[0], moved[1], moved[2]);
    radius_b = ball_b.r * a_from_b.scale;
    volume_b = sums_b.volume * (a_from_b.scale * a_from_b.scale * a_from_b.scale);
    distance = (centre_b - centre_a).norm();
  }

  /// Every point of the overlap lies in at most κ spheres of either tree, and in both balls.
  double bound() const {
    // Rounding of the centres must not let a touching pair pass for a separate one.
    const double rounding = 1e-14 * (centre_a.norm() + centre_b.norm() + ball_a.r + radius_b);
    const Lens<double> outer = lens(ball_a.r + rounding, radius_b + rounding, distance);
    return (1 + 1e-9) * std::min({sums_b.overlap * sums_a.volume, sums_a.overlap * volume_b,
                                  sums_a.overlap * sums_b.overlap * outer.volume()});
  }

  NodeBall ball_a;
  NodeSums sums_a, sums_b;
  Eigen::Vector3d centre_a, centre_b;
  double radius_b, volume_b, distance;
};

}  // namespace

double bound_pair(const SphereTree& a, int level_a, std::uint32_t block_a, const SphereTree& b,
                  int level_b, std::uint32_t block_b, const Similarity& a_from_b) noexcept {
  return Nodes(a, level_a, block_a, b, level_b, block_b, a_from_b).bound();
}

PairEstimate estimate_pair(const SphereTree& a, int level_a, std::uint32_t block_a,
                           const SphereTree& b, int level_b, std::uint32_t block_b,
                           const Similarity& a_from_b) noexcept {
  const Nodes nodes(a, level_a, block_a, b, level_b, block_b, a_from_b);
  PairEstimate result;
  result.bound = nodes.bound();
  const double radius_a = nodes.ball_a.r, radius_b = nodes.radius_b, d = nodes.distance;
  const Lens<double> inner = lens(radius_a, radius_b, d);
  const double overlap = inner.volume();
  if (!(overlap > 0)) return result;
  const double density_a = nodes.sums_a.volume / (kBallVolume * radius_a * radius_a * radius_a);
  const double density_b = nodes.volume_b / (kBallVolume * radius_b * radius_b * radius_b);
  const double guess = density_a * density_b * overlap;
  result.volume = std::min(guess, result.bound);
  const double share = result.volume / overlap;
  if (d > 0) result.force = share * inner.derivative() / d * (nodes.centre_b - nodes.centre_a);
  result.centre =
      (inner.cap_a * nodes.centre_a + inner.cap_b * nodes.centre_b) / (inner.cap_a + inner.cap_b);
  return result;
}

}  // namespace ist
