#include "spheres/recentre.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace ist {
namespace {

using Eigen::Vector3d;

struct Look {
  double farthest = 0, nearest = 0;
  double excess() const { return farthest - nearest; }
};

Look look(const Vector3d& c, std::span<const Vector3d> points, std::span<const Vector3d> walls) {
  double far2 = 0, near2 = std::numeric_limits<double>::infinity();
  for (const Vector3d& p : points) far2 = std::max(far2, (p - c).squaredNorm());
  for (const Vector3d& w : walls) near2 = std::min(near2, (w - c).squaredNorm());
  return {std::sqrt(far2), walls.empty() ? 0 : std::sqrt(near2)};
}

/// Directions from what nearly counts to the centre.
struct Slopes {
  std::vector<Vector3d> up, down;

  void collect(const Vector3d& c, const Look& at, std::span<const Vector3d> points,
               std::span<const Vector3d> walls, double slack) {
    up.clear();
    down.clear();
    const double from = std::max(0.0, at.farthest - slack), to = at.nearest + slack;
    for (const Vector3d& p : points)
      if (const double d2 = (p - c).squaredNorm(); d2 >= from * from && d2 > 0)
        up.push_back((c - p) / std::sqrt(d2));
    for (const Vector3d& w : walls)
      if (const double d2 = (w - c).squaredNorm(); d2 <= to * to && d2 > 0)
        down.push_back((c - w) / std::sqrt(d2));
    if (up.empty()) up.push_back(Vector3d::Zero());
    if (down.empty()) down.push_back(Vector3d::Zero());
  }

  /// The shortest vector of hull(up) − hull(down), by Frank and Wolfe's steps.
  Vector3d shortest() const {
    Vector3d g = up.front() - down.front();
    for (int step = 0; step < 24; ++step) {
      const Vector3d* u = &up.front();
      const Vector3d* v = &down.front();
      double least = std::numeric_limits<double>::infinity(), most = -least;
      for (const Vector3d& one : up)
        if (const double x = g.dot(one); x < least) least = x, u = &one;
      for (const Vector3d& one : down)
        if (const double x = g.dot(one); x > most) most = x, v = &one;
      const Vector3d way = (*u - *v) - g;
      const double slope = -g.dot(way);
      if (slope <= 1e-3 * g.squaredNorm()) break;
      g += std::min(1.0, slope / way.squaredNorm()) * way;
    }
    return g;
  }
};

}  // namespace

Recentred recentre(const Vector3d& start, std::span<const Vector3d> points,
                   std::span<const Vector3d> walls, double trust) {
  Vector3d c = start;
  Look at = look(c, points, walls);
  double slack = 0.3 * trust, step = 0.5 * trust;
  Slopes slopes;
  for (int round = 0; round < 14 && slack > 1e-3 * trust; ++round) {
    slopes.collect(c, at, points, walls, slack);
    const Vector3d g = slopes.shortest();
    const double slope = std::sqrt(g.squaredNorm());
    if (slope < 0.02) {
      slack *= 0.2;
      continue;
    }
    bool moved = false;
    for (double t = step; t > 0.02 * slack; t *= 0.4) {
      const Vector3d next = c - (t / slope) * g;
      if ((next - start).squaredNorm() > trust * trust) continue;
      const Look there = look(next, points, walls);
      if (there.excess() < at.excess() - 0.1 * t * slope) {
        c = next;
        at = there;
        step = std::min(2 * t, trust);
        moved = true;
        break;
      }
    }
    if (!moved) slack *= 0.3;
  }
  return {c, at.excess()};
}

}  // namespace ist
