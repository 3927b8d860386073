#pragma once

#include "query/exact/expansion.h"

// Exact signs of determinants of four points, of which some belong to B. A tie is broken as if B
// were moved by an infinitesimal (ε, ε², ε³): then no vertex lies in a plane and no edge meets an
// edge, whatever the pose, and all signs agree with each other as those of one geometry do.

namespace ist::exact {

struct Point {
  double x, y, z;
};

IST_HD Point operator+(const Point& a, const Point& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
IST_HD Point operator-(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
IST_HD Point operator*(double s, const Point& a) { return {s * a.x, s * a.y, s * a.z}; }
IST_HD double dot(const Point& a, const Point& b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }
IST_HD Point cross(const Point& a, const Point& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// A rounded determinant and how far it may be off; its sign once it is certain.
struct Determinant {
  double value;
  double error;  ///< 0: `value` is the nearest double, or nearly
  int sign;      ///< never 0
};

/// Rounded r · (u × v) of rounded differences is off by at most this times r · (u × v) of absolute
/// values: eight roundings of each product, and some room.
inline constexpr double kFilter = 1e-15;

/// (r1 − r0) · ((u1 − u0) × (v1 − v0)), where r1 moves along with the infinitesimal (`moved` = 1),
/// or r0 does (−1); the others' differences stay.
IST_HD Determinant exact_determinant(const Point& r1, const Point& r0, const Point& u1,
                                     const Point& u0, const Point& v1, const Point& v0, int moved) {
  const Expansion<2> ux = difference(u1.x, u0.x), uy = difference(u1.y, u0.y),
                     uz = difference(u1.z, u0.z);
  const Expansion<2> vx = difference(v1.x, v0.x), vy = difference(v1.y, v0.y),
                     vz = difference(v1.z, v0.z);
  const Expansion<16> x = minor(uy, vz, uz, vy);
  const Expansion<16> y = minor(uz, vx, ux, vz);
  const Expansion<16> z = minor(ux, vy, uy, vx);
  const auto det = sum(sum(product(x, difference(r1.x, r0.x)), product(y, difference(r1.y, r0.y))),
                       product(z, difference(r1.z, r0.z)));
  int sign = det.sign();
  if (sign == 0) sign = moved * (x.count != 0 ? x.sign() : y.count != 0 ? y.sign() : z.sign());
  // Of a triangle without area, or of parallel edges: any sign that is always the same will do.
  return {det.value(), 0, sign != 0 ? sign : 1};
}

/// The same, in doubles where these are certain.
IST_HD Determinant determinant(const Point& r1, const Point& r0, const Point& u1, const Point& u0,
                               const Point& v1, const Point& v0, int moved) {
  const Point r = r1 - r0, u = u1 - u0, v = v1 - v0;
  const double ax = u.y * v.z, bx = u.z * v.y, ay = u.z * v.x, by = u.x * v.z, az = u.x * v.y,
               bz = u.y * v.x;
  const double value = (r.x * (ax - bx) + r.y * (ay - by)) + r.z * (az - bz);
  const double error = kFilter * ((std::abs(r.x) * (std::abs(ax) + std::abs(bx)) +
                                   std::abs(r.y) * (std::abs(ay) + std::abs(by))) +
                                  std::abs(r.z) * (std::abs(az) + std::abs(bz)));
  if (std::abs(value) > error) return {value, error, value > 0 ? 1 : -1};
  return exact_determinant(r1, r0, u1, u0, v1, v0, moved);
}

/// How far B's point lies above triangle A's plane: > 0 outside.
IST_HD Determinant height_over_a(const Point (&a)[3], const Point& b) {
  return determinant(b, a[0], a[1], a[0], a[2], a[0], 1);
}

/// How far A's point lies above triangle B's plane.
IST_HD Determinant height_over_b(const Point (&b)[3], const Point& a) {
  return determinant(a, b[0], b[1], b[0], b[2], b[0], -1);
}

/// Which way round A's edge p → q goes about B's edge r → s.
IST_HD Determinant way_round(const Point& p, const Point& q, const Point& r, const Point& s) {
  return determinant(r, p, q, p, s, r, 1);
}

}  // namespace ist::exact
