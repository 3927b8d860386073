#pragma once

#include <cstdint>

#include "cuda/query/disc_sums.h"
#include "cuda/query/surface_sides.h"
#include "numerics/host_device.h"

namespace ist::gpu {

/// The triangles of a surface (DiscSums): `a` is 16 · block + lane.
class SurfaceSource {
 public:
  IST_HD SurfaceSource(const SurfaceRef& surface, SurfaceNode* room)
      : surface_(surface), room_(room) {}

  IST_HD void corners(const TriangleId& id, const double (&)[3], double, double (&c)[3][3]) const {
    surface_.corners(id.a, c);
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
          visit(there, TriangleId{there ? child : 0, 0});
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

  /// Whether a child of a node, in a lane of its block, comes near a ball.
  IST_HD bool comes_near(SurfaceNode node, int lane, const double (&x)[3], double reach) const {
    const auto at = static_cast<std::uint32_t>(lane);
    if (rank_of(node) == kTriangleBlock) {
      double c[3][3];
      surface_.corners(number_of(node) * kWidth + at, c);
      return triangle_comes_near(c, x, reach);
    }
    const NodeBall ball = surface_.lane_ball(rank_of(node) - 1, number_of(node), at);
    return ball.r > 0 && balls_meet(ball, x, reach);
  }

  /// True at least where it does: told by its box and by its plane.
  IST_HD static bool triangle_comes_near(const double (&c)[3][3], const double (&x)[3],
                                         double reach) {
    const double reach2 = reach * reach;
    double beyond2 = 0, p[3], e[3], f[3];
    for (int k = 0; k < 3; ++k) {
      p[k] = c[0][k] - x[k];
      e[k] = c[1][k] - c[0][k];
      f[k] = c[2][k] - c[0][k];
      const double low = p[k] + least(least(e[k], f[k]), 0),
                   high = p[k] + most(most(e[k], f[k]), 0);
      const double beyond = most(most(low, -high), 0);
      beyond2 += beyond * beyond;
    }
    if (beyond2 > reach2) return false;
    const double n[3] = {e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2],
                         e[0] * f[1] - e[1] * f[0]};
    const double height = (n[0] * p[0] + n[1] * p[1]) + n[2] * p[2];
    const double n2 = (n[0] * n[0] + n[1] * n[1]) + n[2] * n[2];
    return n2 > 0 && height * height <= n2 * reach2 * (1 + 1e-9);
  }

  IST_HD static bool balls_meet(const NodeBall& ball, const double (&x)[3], double reach) {
    const double dx = ball.centre[0] - x[0], dy = ball.centre[1] - x[1], dz = ball.centre[2] - x[2];
    const double sum = ball.r + reach;
    return (dx * dx + dy * dy) + dz * dz <= sum * sum;
  }

  /// Finds in each block a ball whose side is known: by the surface in it, else in the grid.
  template <class Team>
  IST_HD void ready_sides(const Team& team, DiscMemory& m, int held) const {
    for (int slot = team.lane(); slot < round_up_to(held, Team::kWidth); slot += Team::kWidth) {
      std::uint32_t known = kNoBall, first = kNoBall;
      double least_angle = 1e300;
      for (std::uint32_t k = 0; slot < held && k < kWidth; ++k) {
        const std::uint32_t ball = static_cast<std::uint32_t>(slot) * kWidth + k;
        if (!(m.r[ball] > 0)) continue;
        if (first == kNoBall) first = ball;
        const double angle = size_of(m.angle[ball]);
        if (!(angle > 1e-6) || !(angle < least_angle)) continue;
        least_angle = angle;
        known = ball;
      }
      const bool look = known == kNoBall && first != kNoBall;
      double x[3] = {0, 0, 0};
      if (look) m.seen(static_cast<int>(first), x);
      const bool inside = inside_surface(team, surface_, look, x);
      if (slot >= held) continue;
      m.block[slot].known = look ? first : known;
      m.block[slot].known_inside = look ? inside : known != kNoBall && m.angle[known] < 0;
    }
    team.sync();
  }

  /// From the known ball through the triangles between, or in the grid where these are many.
  template <class Team>
  IST_HD bool inside(const Team& team, const DiscMemory& m, int ball, bool wanted) const {
    double x[3] = {0, 0, 0};
    if (wanted) m.seen(ball, x);
    const HeldBlock& block = m.block[wanted ? ball / static_cast<int>(kWidth) : 0];
    const bool many = block.near > kKeptNear;
    bool result = inside_surface(team, surface_, wanted && many, x);
    if (!wanted || many) return result;
    result = block.known_inside;
    if (block.known == static_cast<std::uint32_t>(ball)) return result;
    double from[3], way[3];
    m.seen(static_cast<int>(block.known), from);
    for (int k = 0; k < 3; ++k) way[k] = x[k] - from[k];
    for (std::uint32_t i = 0; i < block.near; ++i)
      if (steps_through(from, way, surface_, block.kept[i].a)) result = !result;
    return result;
  }

 private:
  IST_HD static constexpr int round_up_to(int count, int width) {
    return (count + width - 1) / width * width;
  }
  IST_HD static constexpr int round_up(int width) {
    return round_up_to(static_cast<int>(kWidth), width);
  }

  const SurfaceRef& surface_;
  SurfaceNode* room_;
};

}  // namespace ist::gpu
