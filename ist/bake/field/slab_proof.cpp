#include "bake/field/slab_proof.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "bake/field/hull.h"
#include "bake/field/triangles_in_box.h"
#include "mesh/exact_sign.h"
#include "mesh/triangle_frame.h"
#include "mesh/winding.h"
#include "numerics/rounding.h"

namespace ist {
namespace {

using Point = std::array<double, 3>;

constexpr double kRounding = 1e-14;  // of a height in the unit frame, with room

/// A hull moved along a direction.
struct MovedHull {
  std::array<Point, Hull::kMost> corner;
  std::size_t count;
  float low[3], high[3];
  double least, most;  ///< along the direction

  MovedHull(std::span<const Point> hull, const double direction[3], double by)
      : count(hull.size()), least(HUGE_VAL), most(-HUGE_VAL) {
    std::fill(low, low + 3, HUGE_VALF);
    std::fill(high, high + 3, -HUGE_VALF);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        corner[i][k] = hull[i][k] + by * direction[k];
        low[k] = std::min(low[k], rounded_down(corner[i][k]));
        high[k] = std::max(high[k], rounded_up(corner[i][k]));
      }
      const double height = dot3(corner[i].data(), direction);
      least = std::min(least, height);
      most = std::max(most, height);
    }
  }

  /// A plane across the direction, or along the triangle, has all of it on one side.
  bool is_apart_from(const double* const p[3], const double direction[3]) const {
    const double height[3] = {dot3(p[0], direction), dot3(p[1], direction), dot3(p[2], direction)};
    if (std::max({height[0], height[1], height[2]}) < least - kRounding) return true;
    if (std::min({height[0], height[1], height[2]}) > most + kRounding) return true;
    double u[3], v[3], n[3];
    for (int k = 0; k < 3; ++k) {
      u[k] = p[1][k] - p[0][k];
      v[k] = p[2][k] - p[0][k];
    }
    cross3(u, v, n);
    const double room = kRounding * (std::fabs(n[0]) + std::fabs(n[1]) + std::fabs(n[2]));
    bool above = room > 0, below = room > 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double w[3] = {corner[i][0] - p[0][0], corner[i][1] - p[0][1], corner[i][2] - p[0][2]};
      const double side = dot3(n, w);
      above &= side > room;
      below &= side < -room;
    }
    return above || below;
  }
};

bool meets_none(const MeshView& surface, const MovedHull& hull, const double direction[3]) {
  return none_in_box(surface, hull.low, hull.high, [&](const Corners& triangle) {
    return !hull.is_apart_from(triangle.p, direction);
  });
}

/// Whether the winding number differs between two points off the surface: the way between is short,
/// a ray is not.
bool windings_differ(const MeshView& surface, const double p[3], const double q[3]) {
  float low[3], high[3];
  for (int k = 0; k < 3; ++k) {
    low[k] = rounded_down(std::min(p[k], q[k]));
    high[k] = rounded_up(std::max(p[k], q[k]));
  }
  int difference = 0;
  const bool clear = none_in_box(surface, low, high, [&](const Corners& t) {
    int turns[3];  // of the way about the sides
    for (int i = 0; i < 3; ++i) turns[i] = orient3d_sign(p, q, t.p[i], t.p[(i + 1) % 3]);
    const auto [least, most] = std::minmax({turns[0], turns[1], turns[2]});
    if (least < 0 && most > 0) return false;
    const int from = orient3d_sign(t.p[0], t.p[1], t.p[2], p);
    const int to = orient3d_sign(t.p[0], t.p[1], t.p[2], q);
    if (from == to && from != 0) return false;
    if (turns[0] == 0 || turns[1] == 0 || turns[2] == 0 || from == 0 || to == 0) return true;
    difference += from;
    return false;
  });
  return clear ? difference != 0 : winding_number(surface, p) != winding_number(surface, q);
}

}  // namespace

bool within_slab(const MeshView& surface, std::span<const Point> hull, const double direction[3],
                 double distance) {
  const MovedHull there(hull, direction, distance);
  if (!meets_none(surface, there, direction)) return false;
  const MovedHull back(hull, direction, -distance);
  if (!meets_none(surface, back, direction)) return false;
  return windings_differ(surface, there.corner[0].data(), back.corner[0].data());
}

}  // namespace ist
