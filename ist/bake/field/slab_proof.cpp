#include "bake/field/slab_proof.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "mesh/closest_point.h"
#include "mesh/triangle_frame.h"
#include "mesh/winding.h"
#include "numerics/rounding.h"

namespace ist {
namespace {

using Point = std::array<double, 3>;

constexpr double kRounding = 1e-14;  // of a height in the unit frame, with room

/// A hull moved along a direction.
struct MovedHull {
  std::array<Point, 6> corner;
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
  std::uint32_t stack[kBvhStackSize];
  int top = 0;
  stack[top++] = surface.root;
  while (top > 0) {
    const std::uint32_t at = stack[--top];
    if ((at & kBvhLeaf) != 0) {
      for (const std::uint32_t triangle : surface.blocks[at & ~kBvhLeaf].triangle) {
        if (triangle == kNoTriangle) continue;
        const std::uint32_t* t = surface.triangles + 3 * std::size_t{triangle};
        const double* p[3];
        for (int i = 0; i < 3; ++i) p[i] = surface.vertices + 3 * std::size_t{t[i]};
        if (!hull.is_apart_from(p, direction)) return false;
      }
      continue;
    }
    const BvhNode& node = surface.nodes[at];
    for (int i = 0; i < kBvhWidth; ++i) {
      bool hit = node.child[i] != kBvhEmpty;
      for (int k = 0; k < 3; ++k)
        hit &= node.lower[k][i] <= hull.high[k] && node.upper[k][i] >= hull.low[k];
      if (hit) stack[top++] = node.child[i];
    }
  }
  return true;
}

}  // namespace

bool within_slab(const MeshView& surface, std::span<const Point> hull, const double direction[3],
                 double distance) {
  const MovedHull there(hull, direction, distance);
  if (!meets_none(surface, there, direction)) return false;
  const MovedHull back(hull, direction, -distance);
  if (!meets_none(surface, back, direction)) return false;
  return winding_number(surface, there.corner[0].data()) !=
         winding_number(surface, back.corner[0].data());
}

}  // namespace ist
