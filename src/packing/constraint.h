#pragma once

#include "packing/float3.h"

namespace ist::packing {

/// The distance to one feature (sphere, triangle, surface point) around a point x. For |y| ≤ h,
///   distance + gradient·y ≤ feature's distance at x + y ≤ distance + gradient·y + curvature h²:
/// the left side because these features are convex, the right side because the distance to a point
/// at range l obeys |v + y| ≤ l + v·y/l + |y|²/(2l).
struct Constraint {
  Float3 gradient;      ///< unit vector away from the feature
  float distance = 0;   ///< signed: negative inside a sphere
  float curvature = 0;  ///< 1/(2l), l the distance to the sphere's centre or to the closest point
};

/// The ball {centre, radius} seen from x. A surface point is a ball of radius 0.
IST_HD inline Constraint ball_constraint(Float3 centre, float radius, Float3 x) {
  const Float3 v = x - centre;
  const float l = norm(v);
  if (!(l > 0)) return {{1, 0, 0}, -radius, 1e30f};
  const float inverse = 1 / l;
  return {inverse * v, l - radius, 0.5f * inverse};
}

}  // namespace ist::packing
