#pragma once

#include <cmath>
#include <cstdint>

#include "base/elementary.h"
#include "base/host_device.h"
#include "packing/backend/tasks.h"

// The subdivision that proves cover radii (cover.h), cell by cell, for host and device. It proceeds
// level by level: extensions that a level requests take effect at the next level, so the result
// depends neither on the order of the cells nor on that of the lists.

namespace ist {

// Every ball starts larger than necessary by this, over the mean leaf radius: then cells that it
// contains need not be divided down to the surface.
constexpr double kCoverSlack = 0.1;
// A cell is small enough if its half-diagonal is this part of the extension that it requests.
constexpr double kCoverRefinement = 0.2;

/// A cube that is not yet proven covered, and the balls that may be nearest somewhere in it.
struct CoverCell {
  double x = 0, y = 0, z = 0;  ///< centre, unit frame
  std::uint32_t first = 0;     ///< of its list
  std::uint32_t count = 0;     ///< balls listed
  bool inside = false;         ///< known to be wholly inside the solid
};

/// One level's cells differ only in their positions.
struct CoverLevel {
  double half = 0;      ///< half edge, unit frame
  double smallest = 0;  ///< half-diagonal of a cell that is small enough
  const CoverBall* balls = nullptr;
  const double* extension = nullptr;  ///< of every ball, after the levels before

  /// Half-diagonal, rounded up.
  IST_HD double reach() const { return 1.7320508075688774 * half + kDistanceMargin; }
};

IST_HD inline double distance_to(const CoverBall& ball, double x, double y, double z) {
  const double dx = x - ball.x, dy = y - ball.y, dz = z - ball.z;
  return std::sqrt(dx * dx + dy * dy + dz * dz);
}

/// Largest distance of the cube of half edge `half` around (x, y, z) from the ball's centre.
IST_HD inline double farthest_from(const CoverBall& ball, double x, double y, double z,
                                   double half) {
  const auto across = [half](double d) { return (d < 0 ? -d : d) + half; };
  const double dx = across(x - ball.x), dy = across(y - ball.y), dz = across(z - ball.z);
  return std::sqrt(dx * dx + dy * dy + dz * dz);
}

/// A ball and the extension of its radius that is requested.
struct CoverDemand {
  double extension = 0;
  std::uint32_t ball = 0xFFFFFFFFu;

  IST_HD bool asks() const { return ball != 0xFFFFFFFFu; }
};

struct CoverVerdict {
  bool divide = false;  ///< it must be divided; `count` balls were kept
  std::uint32_t count = 0;
  bool inside = false;
  CoverDemand demand;
};

/// The listed ball that needs the least extension to reach as far as `measure(ball)`, the smallest
/// index among equals, and the extension that it still needs.
struct CoverBest {
  double lacks = 0;
  std::uint32_t ball = 0;
};

template <class Team, class Measure>
IST_HD CoverBest best_ball(const Team& team, const CoverLevel& level, const std::uint32_t* list,
                           int count, const Measure& measure) {
  double least = 1e300;
  std::uint32_t ball = 0xFFFFFFFFu;
  for (int i = team.lane(); i < count; i += Team::kWidth) {
    const std::uint32_t k = list[i];
    const double lacks = measure(level.balls[k]) - level.balls[k].radius - level.extension[k];
    if (lacks < least || (lacks == least && k < ball)) {
      least = lacks;
      ball = k;
    }
  }
  const double all = team.min(least);
  return {all, team.min(least == all ? ball : 0xFFFFFFFFu)};
}

/// Examines one cell with its parent's list. `keep` (as long as the whole list) receives the balls
/// that may be nearest somewhere in the cell's circumsphere. `surface` provides, for the team:
/// nearest(point, radius, q), false only if the surface is certainly further away than `radius`,
/// else q is about its closest point; inside(point): the winding number is ≥ 1.
template <class Team, class Surface>
IST_HD CoverVerdict cover_cell(const Team& team, const CoverLevel& level, const Surface& surface,
                               const CoverCell& cell, const std::uint32_t* list,
                               std::uint32_t* keep) {
  const double reach = level.reach();
  const auto count = static_cast<int>(cell.count);
  double nearest = 1e300;
  for (int i = team.lane(); i < count; i += Team::kWidth) {
    const CoverBall& ball = level.balls[list[i]];
    const double gap = distance_to(ball, cell.x, cell.y, cell.z) - ball.radius;
    nearest = gap < nearest ? gap : nearest;
  }
  nearest = team.min(nearest);
  int kept = 0;
  double plain = 1e300;  // extension that the best ball would need without any so far
  for (int base = 0; base < count; base += Team::kWidth) {
    const int i = base + team.lane();
    bool stays = false;
    if (i < count) {
      const CoverBall& ball = level.balls[list[i]];
      const double gap = distance_to(ball, cell.x, cell.y, cell.z) - ball.radius;
      stays = gap <= nearest + 2 * reach;
      if (stays) {
        const double lacks = farthest_from(ball, cell.x, cell.y, cell.z, level.half) - ball.radius;
        plain = lacks < plain ? lacks : plain;
      }
    }
    int total = 0;
    const int place = kept + team.exclusive_count(stays, total);
    if (stays) keep[place] = list[i];
    kept += total;
  }
  plain = team.min(plain);
  team.sync();

  CoverVerdict verdict;
  const auto farthest = [&](const CoverBall& ball) {
    return farthest_from(ball, cell.x, cell.y, cell.z, level.half);
  };
  const CoverBest whole = best_ball(team, level, keep, kept, farthest);
  if (whole.lacks + kDistanceMargin <= 0) return verdict;  // one ball contains the cell

  // A point of the solid in or near the cell: its middle, or the surface's nearest.
  double point[3] = {cell.x, cell.y, cell.z};
  verdict.inside = cell.inside;
  if (!cell.inside) {
    double on_surface[3];
    if (surface.nearest(point, reach, on_surface)) {
      for (int k = 0; k < 3; ++k) point[k] = on_surface[k];
    } else {
      if (!surface.inside(point)) return verdict;
      verdict.inside = true;
    }
  }
  if (reach <= level.smallest || reach <= kCoverRefinement * (plain - reach)) {
    const CoverBall& ball = level.balls[whole.ball];
    verdict.demand = {farthest(ball) - ball.radius + kDistanceMargin, whole.ball};
    return verdict;
  }
  verdict.divide = true;
  verdict.count = static_cast<std::uint32_t>(kept);
  const auto to_point = [&](const CoverBall& ball) {
    return distance_to(ball, point[0], point[1], point[2]);
  };
  const CoverBest there = best_ball(team, level, keep, kept, to_point);
  if (there.lacks > 0) {
    const CoverBall& ball = level.balls[there.ball];
    verdict.demand = {to_point(ball) - ball.radius + level.smallest, there.ball};
  }
  return verdict;
}

/// Child `octant` of a divided cell whose half edge is twice `half`; it inherits the list.
IST_HD inline CoverCell cover_child(const CoverCell& parent, int octant, double half) {
  CoverCell child = parent;
  child.x += (octant & 1) != 0 ? half : -half;
  child.y += (octant & 2) != 0 ? half : -half;
  child.z += (octant & 4) != 0 ? half : -half;
  return child;
}

}  // namespace ist
