#pragma once

#include <cmath>
#include <numbers>

#include "base/host_device.h"

namespace ist {

// Arithmetic on plain numbers, for host and device code.

// std::min, std::max and std::clamp, which the device does not have.
IST_HD inline double least(double x, double y) { return x < y ? x : y; }
IST_HD inline double most(double x, double y) { return x > y ? x : y; }
IST_HD inline double clamped(double x, double low, double high) {
  return x < low ? low : high < x ? high : x;
}

inline constexpr double kBallVolume = 4 * std::numbers::pi / 3;
IST_HD inline double ball_volume(double r) { return kBallVolume * (r * r * r); }

/// Three doubles, for host and device code. Sums run from left to right.
struct Vec3 {
  double x, y, z;

  IST_HD double& operator[](int k) { return k == 0 ? x : k == 1 ? y : z; }
  IST_HD double operator[](int k) const { return k == 0 ? x : k == 1 ? y : z; }
};

IST_HD inline Vec3 vec3(const double (&x)[3]) { return {x[0], x[1], x[2]}; }

IST_HD inline Vec3 operator+(const Vec3& a, const Vec3& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
IST_HD inline Vec3 operator-(const Vec3& a, const Vec3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
IST_HD inline Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
IST_HD inline Vec3 operator*(double s, const Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
IST_HD inline Vec3 operator/(const Vec3& a, double s) { return {a.x / s, a.y / s, a.z / s}; }
IST_HD inline double dot(const Vec3& a, const Vec3& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
IST_HD inline double norm(const Vec3& a) { return std::sqrt(dot(a, a)); }
IST_HD inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// The same for arrays.
IST_HD inline double dot(const double (&a)[3], const double (&b)[3]) {
  return dot(vec3(a), vec3(b));
}
IST_HD inline double norm(const double (&a)[3]) { return norm(vec3(a)); }
IST_HD inline void cross(const double (&a)[3], const double (&b)[3], double (&out)[3]) {
  const Vec3 c = cross(vec3(a), vec3(b));
  out[0] = c.x, out[1] = c.y, out[2] = c.z;
}

/// A point or vector of the unit frame, in float, for host and device code.
struct Float3 {
  float x = 0, y = 0, z = 0;
};

IST_HD inline Float3 operator+(Float3 a, Float3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
IST_HD inline Float3 operator-(Float3 a, Float3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
IST_HD inline Float3 operator*(float s, Float3 a) { return {s * a.x, s * a.y, s * a.z}; }
IST_HD inline float dot(Float3 a, Float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
IST_HD inline float norm(Float3 a) { return sqrtf(dot(a, a)); }

}  // namespace ist
