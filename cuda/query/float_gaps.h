#pragma once

#include <cmath>

#include "base/host_device.h"

// The nearest points of triangles in float, accurate enough to bound the distance of others.

namespace ist::gpu::single {

using Real = float;
using Mask = bool;

struct Vec3 {
  float x, y, z;
};
IST_HD inline Vec3 operator+(const Vec3& a, const Vec3& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
IST_HD inline Vec3 operator-(const Vec3& a, const Vec3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
IST_HD inline Vec3 operator*(float s, const Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
IST_HD inline float dot(const Vec3& a, const Vec3& b) {
  return std::fma(a.x, b.x, std::fma(a.y, b.y, a.z * b.z));
}
IST_HD inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {std::fma(a.y, b.z, -(a.z * b.y)), std::fma(a.z, b.x, -(a.x * b.z)),
          std::fma(a.x, b.y, -(a.y * b.x))};
}
IST_HD inline float constant(double x) { return static_cast<float>(x); }
IST_HD inline float lesser(float x, float y) { return x < y ? x : y; }
IST_HD inline float greater(float x, float y) { return x > y ? x : y; }
IST_HD inline bool less(float x, float y) { return x < y; }
IST_HD inline bool at_most(float x, float y) { return x <= y; }
IST_HD inline bool both(bool x, bool y) { return x && y; }
IST_HD inline float choose(bool of, float x, float y) { return of ? x : y; }
IST_HD inline float least_inverted() { return 1e-30f; }

#define IST_FORMULA IST_HD inline
#include "query/exact/edge_gap_formulas-inl.h"
#undef IST_FORMULA

/// A triangle. Its nearest points are on it up to rounding, however thin it is, so bounds from them
/// are valid.
struct Face {
  Vec3 corner, side, other, normal;
  float inverse_normal;

  IST_HD Face(const Vec3& from, const Vec3& u, const Vec3& v)
      : corner(from), side(u), other(v), normal(cross(u, v)) {
    inverse_normal = inverse_of(dot(normal, normal));
  }
  /// The distance of a corner from a triangle.
  template <bool kCornerOfA>
  IST_HD void take(const Vec3& p, NearestPoints& least) const {
    const Vec3 r = p - corner;
    const float v = dot(cross(r, other), normal) * inverse_normal,
                w = dot(cross(side, r), normal) * inverse_normal;
    const bool inside = v >= 0 && w >= 0 && v + w <= 1 && inverse_normal > 0;
    const Vec3 foot = v * side + w * other, up = r - foot;
    if constexpr (kCornerOfA)
      take_nearer(least, dot(up, up), inside, p, -1.0f * up);
    else
      take_nearer(least, dot(up, up), inside, corner + foot, up);
  }
};

}  // namespace ist::gpu::single
