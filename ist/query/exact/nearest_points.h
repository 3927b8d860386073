#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "query/exact/orientation.h"

// The nearest points of segments and triangles, in double. Points are on them up to rounding, so
// they bound the distance from above however thin the triangles are.

namespace ist::exact {

/// The nearest two points that were found so far.
struct NearestPair {
  double squared = HUGE_VAL;  ///< distance
  Point a = {}, b = {};

  /// Takes these points if they are nearer, and returns true if so.
  bool take(const Point& on_a, const Point& on_b) noexcept {
    const Point between = on_b - on_a;
    const double s = dot(between, between);
    if (!(s < squared)) return false;
    squared = s;
    a = on_a;
    b = on_b;
    return true;
  }
  /// Unit, from a to b; zero if these are one.
  Point direction() const noexcept {
    return squared > 0 ? 1 / std::sqrt(squared) * (b - a) : Point{0, 0, 0};
  }
};

inline Point nearest_on_segment(const Point& p, const Point& from, const Point& to) noexcept {
  const Point u = to - from;
  const double uu = dot(u, u), along = dot(p - from, u);
  if (!(along > 0)) return from;
  return along < uu ? from + (along / uu) * u : to;
}

/// A triangle with the data for its nearest points.
struct FlatTriangle {
  Point corner[3];
  Point side[3];  ///< from corner k to the next
  Point normal;   ///< twice the area long
  double squared_normal;

  explicit FlatTriangle(const Point& p, const Point& q, const Point& r) noexcept
      : corner{p, q, r},
        side{q - p, r - q, p - r},
        normal(cross(side[0], side[1])),
        squared_normal(dot(normal, normal)) {}
};

inline Point nearest_on_triangle(const Point& p, const FlatTriangle& t) noexcept {
  double weight[3];
  bool inside = t.squared_normal > 0;
  for (int k = 0; k < 3 && inside; ++k) {
    weight[(k + 2) % 3] = dot(t.normal, cross(t.side[k], p - t.corner[k]));
    inside = weight[(k + 2) % 3] >= 0;
  }
  if (inside) {
    const double sum = (weight[0] + weight[1]) + weight[2];
    if (sum > 0)
      return t.corner[0] + ((weight[1] / sum) * t.side[0] - (weight[2] / sum) * t.side[2]);
  }
  NearestPair best;
  for (int k = 0; k < 3; ++k)
    best.take(nearest_on_segment(p, t.corner[k], t.corner[(k + 1) % 3]), p);
  return best.a;
}

/// Heights of a triangle's corners above the other's plane, times the length of its normal.
using Heights = std::array<double, 3>;

/// Takes the nearest points of two triangles that do not cross, if they are nearer. `enough`: any
/// that are nearer suffice.
inline void take_nearest(const FlatTriangle& a, const FlatTriangle& b, const Heights& over_a,
                         const Heights& over_b, NearestPair& best, bool enough = false) noexcept {
  for (int k = 0; k < 3; ++k) {
    if ((over_b[k] * over_b[k] < best.squared * b.squared_normal || b.squared_normal == 0) &&
        best.take(a.corner[k], nearest_on_triangle(a.corner[k], b)) && enough)
      return;
    if ((over_a[k] * over_a[k] < best.squared * a.squared_normal || a.squared_normal == 0) &&
        best.take(nearest_on_triangle(b.corner[k], a), b.corner[k]) && enough)
      return;
  }
  // Edges whose nearest points are not corners: cross products keep the digits of nearly parallel
  // edges.
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const Point n = cross(a.side[i], b.side[j]), w = b.corner[j] - a.corner[i];
      const double nn = dot(n, n), between = dot(w, n);
      if (!(between * between < best.squared * nn)) continue;  // the lines are further
      const double s = dot(cross(w, b.side[j]), n), t = dot(cross(w, a.side[i]), n);
      if (s > 0 && s < nn && t > 0 && t < nn)
        best.take(a.corner[i] + (s / nn) * a.side[i], b.corner[j] + (t / nn) * b.side[j]);
    }
}

/// True if triangles that do not cross are nearer than `distance`.
inline bool come_within(double distance, const Point (&a)[3], const Point (&b)[3]) noexcept {
  const FlatTriangle of_a(a[0], a[1], a[2]), of_b(b[0], b[1], b[2]);
  Heights over_a, over_b;
  for (std::size_t k = 0; k < 3; ++k) {
    over_a[k] = dot(of_a.normal, b[k] - a[0]);
    over_b[k] = dot(of_b.normal, a[k] - b[0]);
  }
  NearestPair best;
  best.squared = distance * distance;
  take_nearest(of_a, of_b, over_a, over_b, best, true);
  return best.squared < distance * distance;
}

}  // namespace ist::exact
