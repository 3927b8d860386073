#pragma once

#include <cstdint>

#include "numerics/float3.h"

namespace ist::packing {

/// The distance to one feature (sphere, triangle, surface point) around a point x. For |y| ≤ h,
///   distance + gradient·y ≤ feature's distance at x + y ≤ distance + gradient·y + curvature h²:
/// the left side because these features are convex, the right side because the distance to a point
/// at range l obeys |v + y| ≤ l + v·y/l + |y|²/(2l).
struct Constraint {
  Float3 gradient;        ///< unit vector away from the feature; 0 at the feature itself
  float distance = 0;     ///< signed: negative inside a sphere
  float curvature = 0;    ///< 1/(2l), l the distance to the sphere's centre or to the closest point
  std::uint32_t tag = 0;  ///< whose it is: settles ties where order may not
};

// Tags: a sphere's is its index; a triangle's and its plane's are these with the triangle's index.
constexpr std::uint32_t kSurfaceTag = 0x80000000u;
constexpr std::uint32_t kPlaneTag = 0xC0000000u;

/// Where a point stands to a feature that is a ball about its closest point.
struct FeatureOffset {
  Float3 away;       ///< from the closest point, a sphere's centre, to the query
  float range2 = 0;  ///< |away|²
  float radius = 0;  ///< of a sphere; 0 of a surface
  std::uint32_t tag = 0;
};

/// What a search of a surface finds within a limit.
template <class Feature>
struct NearestFeature {
  Feature feature{};
  float distance = 0;  ///< of the feature; the limit where there is none
  bool found = false;
};

/// The ball {centre, radius} seen from x. A surface point is a ball of radius 0.
IST_HD inline FeatureOffset ball_offset(Float3 centre, float radius, std::uint32_t tag, Float3 x) {
  const Float3 away = x - centre;
  return {away, dot(away, away), radius, tag};
}

/// `range` = √range2.
IST_HD inline Constraint constraint_of(const FeatureOffset& offset, float range) {
  const float inverse = range > 0 ? 1 / range : 0;
  return {inverse * offset.away, range - offset.radius, range > 0 ? 0.5f * inverse : 1e30f,
          offset.tag};
}

}  // namespace ist::packing
