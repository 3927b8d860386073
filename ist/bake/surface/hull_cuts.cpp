#include "bake/surface/hull_cuts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "mesh/exact_closest_point.h"
#include "mesh/exact_sign.h"
#include "mesh/triangles_in_box.h"
#include "mesh/winding.h"
#include "numerics/rounding.h"

namespace ist {
namespace {

using HullPoint = std::array<double, 3>;

constexpr double kHeightRounding = 1e-14;  // of a height in the unit frame, with room

/// A hull moved along a direction.
struct MovedHull {
  std::array<HullPoint, Hull::kMost> corner;
  std::size_t count;
  float low[3], high[3];
  double least, most;  ///< along the direction

  MovedHull(std::span<const HullPoint> hull, const double direction[3], double by)
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
    if (std::max({height[0], height[1], height[2]}) < least - kHeightRounding) return true;
    if (std::min({height[0], height[1], height[2]}) > most + kHeightRounding) return true;
    double n[3];
    area_normal(p[0], p[1], p[2], n);
    const double room = kHeightRounding * (std::fabs(n[0]) + std::fabs(n[1]) + std::fabs(n[2]));
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

/// Shows that every point of a hull lies within `distance` of a closed surface: moved by it along
/// `direction` and against it, the hull does not meet the surface, and the winding number is not
/// the same; so the surface passes between. False: it may be so or not. Unit frame.
///
/// `surface` has a hierarchy; `direction` is of unit length, but for rounding.
bool within_slab(const MeshView& surface, std::span<const HullPoint> hull,
                 const double direction[3], double distance) {
  const MovedHull there(hull, direction, distance);
  if (!meets_none(surface, there, direction)) return false;
  const MovedHull back(hull, direction, -distance);
  if (!meets_none(surface, back, direction)) return false;
  return windings_differ(surface, there.corner[0].data(), back.corner[0].data());
}

constexpr int kMostParts = 32;  ///< that are looked at

HullPoint middle_of(const Hull& hull) {
  HullPoint c = {};
  for (const HullPoint& p : hull.corners())
    for (std::size_t k = 0; k < 3; ++k) c[k] += p[k];
  for (double& x : c) x /= static_cast<double>(hull.corners().size());
  return c;
}

double distance2(const HullCuts::Frame& triangle, const HullPoint& p) {
  return closest_in_frame(triangle, p.data()).distance2;
}

bool holds_all(const HullCuts::Frame& triangle, const Hull& hull, double limit2) {
  return std::all_of(hull.corners().begin(), hull.corners().end(),
                     [&](const HullPoint& p) { return distance2(triangle, p) <= limit2; });
}

/// Through a side of a triangle, across it; the triangle is below.
Hull::Plane plane_of_side(const HullCuts::Frame& f, int side) {
  // The side runs along (x, y) of the frame from its corner (from, 0).
  const double x = side == 0 ? f.length : side == 1 ? -f.apex : f.apex - f.length;
  const double y = side == 0 ? 0 : side == 1 ? -f.height : f.height;
  const double from = side == 2 ? f.length : 0, length = std::sqrt(x * x + y * y);
  Hull::Plane plane;
  plane.offset = 0;
  for (int k = 0; k < 3; ++k) {
    plane.u[k] = (x * f.u[k] + y * f.v[k]) / length;
    plane.v[k] = f.n[k];
    plane.normal[k] = (y * f.u[k] - x * f.v[k]) / length;
    plane.offset += plane.normal[k] * (f.origin[k] + from * f.u[k]);
  }
  return plane;
}

}  // namespace

struct HullCuts::Task {
  std::span<const std::uint32_t> candidates;
  double distance;
  int parts = 0;
};

HullCuts::Frame HullCuts::frame(std::uint32_t triangle) const {
  if (!frames_.empty()) return frames_[triangle];
  return frame_of(corners_of(surface_, triangle));
}

bool HullCuts::is_within(const Hull& hull, const Frame& triangle, const Known& known,
                         Task& task) const {
  if (!(triangle.height > 0)) return false;
  const double limit2 = task.distance * task.distance;
  Hull over = hull;
  Hull beyond[3];
  for (int side = 0; side < 3; ++side) {
    const Hull::Plane plane = plane_of_side(triangle, side);
    // Only where something beyond the side is too far away.
    const bool is_needed =
        std::any_of(over.corners().begin(), over.corners().end(), [&](const HullPoint& p) {
          return dot3(plane.normal, p.data()) > plane.offset && distance2(triangle, p) > limit2;
        });
    if (is_needed && (!over.cut(plane, beyond[side]) || over.is_empty())) return false;
  }
  if (!holds_all(triangle, over, limit2)) return false;
  return std::all_of(beyond, beyond + 3, [&](const Hull& part) {
    return part.is_empty() || is_within(part, known, task);
  });
}

bool HullCuts::is_within(const Hull& hull, const Known& known, Task& task) const {
  if (++task.parts > kMostParts) return false;
  const HullPoint c = middle_of(hull);
  const double limit2 = task.distance * task.distance;
  double reach = (known.distance + between(known.at, c)) * (1 + 1e-9) + 1e-12;
  double least2 = reach * reach;
  Frame near;
  bool found = false;
  for (const std::uint32_t t : task.candidates) {
    const Frame f = frame(t);
    const double d2 = distance2(f, c);
    if (d2 >= least2) continue;
    least2 = d2;
    near = f;
    found = true;
  }
  if (found) {
    if (holds_all(near, hull, limit2) || is_within(hull, near, known, task)) return true;
    reach = std::sqrt(least2);
  }
  // The surface may have another triangle that is nearer.
  const ClosestPoint closest = exact_closest_point(surface_, {c[0], c[1], c[2]}, reach);
  if (closest.distance > task.distance) return false;
  if (closest.triangle != kNoTriangle) {
    near = frame(closest.triangle);
    if (holds_all(near, hull, limit2)) return true;
  } else if (!found) {
    return false;
  }
  if (within_slab(surface_, hull.corners(), near.n, task.distance)) return true;
  return closest.triangle != kNoTriangle && is_within(hull, near, {c, closest.distance}, task);
}

bool HullCuts::is_within(const Hull& hull, std::span<const std::uint32_t> candidates,
                         double distance, const Known& known) const {
  Task task{candidates, distance};
  return is_within(hull, known, task);
}

}  // namespace ist
