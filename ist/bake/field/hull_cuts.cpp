#include "bake/field/hull_cuts.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "bake/field/slab_proof.h"
#include "mesh/exact_closest_point.h"

namespace ist {
namespace {

using Point = Hull::Point;

constexpr int kMostParts = 32;  ///< that are looked at

double between(const Point& a, const Point& b) {
  const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  return std::sqrt(dot3(d, d));
}

Point middle_of(const Hull& hull) {
  Point c = {};
  for (const Point& p : hull.corners())
    for (std::size_t k = 0; k < 3; ++k) c[k] += p[k];
  for (double& x : c) x /= static_cast<double>(hull.corners().size());
  return c;
}

double distance2(const HullCuts::Frame& triangle, const Point& p) {
  return closest_in_frame(triangle, p.data()).distance2;
}

bool holds_all(const HullCuts::Frame& triangle, const Hull& hull, double limit2) {
  return std::all_of(hull.corners().begin(), hull.corners().end(),
                     [&](const Point& p) { return distance2(triangle, p) <= limit2; });
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
  const std::uint32_t* t = surface_.triangles + 3 * std::size_t{triangle};
  const auto vertex = [&](int i) { return surface_.vertices + 3 * std::size_t{t[i]}; };
  return make_triangle_frame(vertex(0), vertex(1), vertex(2));
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
        std::any_of(over.corners().begin(), over.corners().end(), [&](const Point& p) {
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
  const Point c = middle_of(hull);
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
