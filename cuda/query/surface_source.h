#pragma once

#include <cmath>
#include <cstdint>

#include "cuda/query/field_walk.h"
#include "cuda/query/surface_sides.h"
#include "numerics/host_device.h"

namespace ist::gpu {

/// The triangles of a surface (BallTests), called 16 · block + lane.
class SurfaceSource {
 public:
  using Id = std::uint32_t;
  static constexpr bool kCrossings = true;

  /// `room`: for each_near().
  IST_HD SurfaceSource(const SurfaceRef& surface, SurfaceNode* room)
      : surface_(surface), room_(room) {}

  IST_HD void corners(Id id, double (&c)[3][3]) const { surface_.corners(id, c); }

  IST_HD bool crosses(const double (&from)[3], const double (&x)[3], Id id) const {
    const double way[3] = {x[0] - from[0], x[1] - from[1], x[2] - from[2]};
    return steps_through(from, way, surface_, id);
  }

  IST_HD static bool settles(const double (&)[3], double, BallPart&) { return false; }

  template <class Team>
  IST_HD bool inside(const Team& team, bool wanted, const double (&x)[3]) const {
    return inside_surface(team, surface_, wanted, x);
  }

  /// From the root down, since hardly ever.
  template <class Team, class Visit>
  IST_HD void each_near(const Team& team, const double (&x)[3], double reach,
                        const Visit& visit) const {
    if (team.lane() == 0) room_[0] = surface_.root_node();
    int size = 1;
    team.sync();
    while (size > 0) {
      const SurfaceNode node = room_[--size];
      team.sync();
      for (int lane = team.lane(); lane < round_up(Team::kWidth); lane += Team::kWidth) {
        const bool there = lane < static_cast<int>(kWidth);
        const std::uint32_t child = number_of(node) * kWidth + static_cast<std::uint32_t>(lane);
        if (rank_of(node) == kTriangleBlock) {
          visit(there, there ? child : 0);
          continue;
        }
        const bool near = there && comes_near(node, lane, x, reach);
        int total = 0;
        const int place = size + team.exclusive_count(near, total);
        if (near) room_[place] = surface_node(rank_of(node) - 1, child);
        size += total;
      }
      team.sync();
    }
  }

  /// Whether a child of a node, in a lane of its block, comes near a ball: at least where it does.
  IST_HD bool comes_near(SurfaceNode node, int lane, const double (&x)[3], double reach) const {
    const auto at = static_cast<std::uint32_t>(lane);
    if (rank_of(node) != kTriangleBlock) {
      const NodeBall ball = surface_.lane_ball(rank_of(node) - 1, number_of(node), at);
      return ball.r > 0 && balls_meet(ball, x, reach);
    }
    float c[3][3], p[3];
    surface_.corners(number_of(node) * kWidth + at, c);
    double far = reach;
    for (int k = 0; k < 3; ++k) {
      p[k] = static_cast<float>(x[k]);
      far = most(far, std::fabs(x[k]));
    }
    return triangle_comes_near(c, p, static_cast<float>(reach + kRounding * far));
  }

  IST_HD static bool balls_meet(const NodeBall& ball, const double (&x)[3], double reach) {
    const double dx = ball.centre[0] - x[0], dy = ball.centre[1] - x[1], dz = ball.centre[2] - x[2];
    const double sum = ball.r + reach;
    return (dx * dx + dy * dy) + dz * dz <= sum * sum;
  }

  /// Told by its box and by its plane; true at least where it does.
  IST_HD static bool triangle_comes_near(const float (&c)[3][3], const float (&x)[3], float reach) {
    float beyond2 = 0, p[3], e[3], f[3], sizes[3] = {0, 0, 0};
    for (int k = 0; k < 3; ++k) {
      p[k] = c[0][k] - x[k];
      e[k] = c[1][k] - c[0][k];
      f[k] = c[2][k] - c[0][k];
      const float low = std::fmin(std::fmin(c[0][k], c[1][k]), c[2][k]) - x[k];
      const float high = std::fmax(std::fmax(c[0][k], c[1][k]), c[2][k]) - x[k];
      const float beyond = std::fmax(std::fmax(low, -high), 0.0f);
      beyond2 = std::fma(beyond, beyond, beyond2);
      sizes[0] += std::fabs(p[k]);
      sizes[1] += std::fabs(e[k]);
      sizes[2] += std::fabs(f[k]);
    }
    if (beyond2 > reach * reach || !(sizes[1] > 0 && sizes[2] > 0)) return false;
    const float n[3] = {e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2],
                        e[0] * f[1] - e[1] * f[0]};
    const float height = std::fabs(std::fma(n[0], p[0], std::fma(n[1], p[1], n[2] * p[2])));
    const float n2 = std::fma(n[0], n[0], std::fma(n[1], n[1], n[2] * n[2]));
    const float over = height - static_cast<float>(kRounding) * (sizes[0] * sizes[1] * sizes[2]);
    constexpr float kFewDigits = 1e-30f;
    return !(over > 0) || n2 < kFewDigits || over * over <= n2 * (reach * reach);
  }

 private:
  static constexpr double kRounding = 1e-6;  ///< of lengths in floats, many times over

  IST_HD static constexpr int round_up(int width) {
    return (static_cast<int>(kWidth) + width - 1) / width * width;
  }

  const SurfaceRef& surface_;
  SurfaceNode* room_;
};

}  // namespace ist::gpu
