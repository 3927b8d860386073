#pragma once

#include "base/vec3.h"
#include "query/exact/expansion.h"

// Exact signs of determinants of four points, some of which belong to B. Signs are those after B
// has moved by a given tiny vector. A tie is broken as if B moved further by an infinitesimal (ε,
// ε², ε³). Then no vertex lies in a plane and no edge meets an edge, whatever the pose, and all
// signs are consistent with one geometry. Values are those of B in place.

namespace ist::exact {

using Point = Vec3;

/// A rounded determinant with B not translated, its error, and its sign with B translated
/// symbolically.
struct Determinant {
  double value;
  double error;  ///< 0: `value` is the nearest double, or nearly
  int sign;      ///< never 0
};

/// r · (u × v) of rounded differences is off by at most this times r · (u × v) of absolute values:
/// eight roundings of each product, and some margin.
inline constexpr double kFilter = 1e-15;

IST_HD inline double absolute_dot(const Point& x, const Point& size) {
  return (std::abs(x.x) * size.x + std::abs(x.y) * size.y) + std::abs(x.z) * size.z;
}

IST_HD inline bool same(const Point& p, const Point& q) {
  return p.x == q.x && p.y == q.y && p.z == q.z;
}

/// The sign of a d − b c of differences, or 0; in doubles where these are certain.
IST_HD_COLD int sign_of_minor(double a1, double a0, double b1, double b0, double c1, double c0,
                              double d1, double d0) {
  const double ad = (a1 - a0) * (d1 - d0), bc = (b1 - b0) * (c1 - c0);
  const double value = ad - bc;
  if (std::abs(value) > kFilter * (std::abs(ad) + std::abs(bc))) return value > 0 ? 1 : -1;
  if (ad == 0 && bc == 0) return 0;  // a difference is 0 only where its numbers are equal
  return sum(product(difference(a1, a0), difference(d1, d0)),
             product(difference(b1, b0), difference(c1, c0)), -1)
      .sign();
}

/// The sign of a tie, from the normal u × v along which the infinitesimal moves.
IST_HD_COLD int sign_of_tie(const Point& u1, const Point& u0, const Point& v1, const Point& v0,
                            int moved) {
  int sign = sign_of_minor(u1.y, u0.y, u1.z, u0.z, v1.y, v0.y, v1.z, v0.z);
  if (sign == 0) sign = sign_of_minor(u1.z, u0.z, u1.x, u0.x, v1.z, v0.z, v1.x, v0.x);
  if (sign == 0) sign = sign_of_minor(u1.x, u0.x, u1.y, u0.y, v1.x, v0.x, v1.y, v0.y);
  // For a triangle without area, or parallel edges, any constant sign is correct.
  return sign != 0 ? moved * sign : 1;
}

/// (r1 − r0) · ((u1 − u0) × (v1 − v0)), where r1 moves along with B (`moved` = 1), or r0 does (−1);
/// the others' differences stay.
IST_HD_COLD Determinant exact_determinant(const Point& r1, const Point& r0, const Point& u1,
                                          const Point& u0, const Point& v1, const Point& v0,
                                          int moved, const Point& aside) {
  // Copies in place share edges.
  if ((same(u1, v1) && same(u0, v0)) || (same(u1, v0) && same(u0, v1))) return {0, 0, 1};
  const Expansion<2> ux = difference(u1.x, u0.x), uy = difference(u1.y, u0.y),
                     uz = difference(u1.z, u0.z);
  const Expansion<2> vx = difference(v1.x, v0.x), vy = difference(v1.y, v0.y),
                     vz = difference(v1.z, v0.z);
  // Computed in steps, so that few expansions exist at a time: on a GPU they are in each thread's
  // local memory.
  Expansion<64> shift_xy;
  const auto xy = [&] {
    const Expansion<16> x = minor(uy, vz, uz, vy), y = minor(uz, vx, ux, vz);
    shift_xy = sum(scaled(x, aside.x), scaled(y, aside.y));
    return sum(product(x, difference(r1.x, r0.x)), product(y, difference(r1.y, r0.y)));
  }();
  const Expansion<16> z = minor(ux, vy, uy, vx);
  const auto det = [&] { return sum(xy, product(z, difference(r1.z, r0.z))); }();
  const int sign = sign_of_sum(det, sum(shift_xy, scaled(z, aside.z)), moved);
  return {det.value(), 0, sign != 0 ? sign : sign_of_tie(u1, u0, v1, v0, moved)};
}

/// r · (u × v) in doubles, of rounded differences, for many r: sign 0 if it is not certain.
struct FilteredPlane {
  Point normal, size;
  double shift, shift_error;  ///< the part of the symbolic translation

  /// `by`: the symbolic translation, or its opposite if r's start moves.
  IST_HD FilteredPlane(const Point& u, const Point& v, const Point& by) {
    const double ax = u.y * v.z, bx = u.z * v.y, ay = u.z * v.x, by_ = u.x * v.z, az = u.x * v.y,
                 bz = u.y * v.x;
    normal = {ax - bx, ay - by_, az - bz};
    size = {std::abs(ax) + std::abs(bx), std::abs(ay) + std::abs(by_), std::abs(az) + std::abs(bz)};
    shift = dot(by, normal);
    shift_error = kFilter * absolute_dot(by, size);
  }
  /// `moved`: a bound of the change by moving points.
  IST_HD Determinant height(const Point& r, double moved = 0) const {
    const double value = dot(r, normal), error = kFilter * absolute_dot(r, size);
    const double signed_value = value + shift;
    const bool certain = std::abs(signed_value) - moved > error + shift_error;
    return {value, error, !certain ? 0 : signed_value > 0 ? 1 : -1};
  }
};

IST_HD_ONCE inline Determinant filtered_determinant(double rx, double ry, double rz, double ux,
                                                    double uy, double uz, double vx, double vy,
                                                    double vz, double shift_x, double shift_y,
                                                    double shift_z) {
  return FilteredPlane({ux, uy, uz}, {vx, vy, vz}, {shift_x, shift_y, shift_z})
      .height({rx, ry, rz});
}
IST_HD inline Determinant filtered_determinant(const Point& r1, const Point& r0, const Point& u1,
                                               const Point& u0, const Point& v1, const Point& v0,
                                               int moved, const Point& aside) {
  const Point r = r1 - r0, u = u1 - u0, v = v1 - v0, by = moved * aside;
  return filtered_determinant(r.x, r.y, r.z, u.x, u.y, u.z, v.x, v.y, v.z, by.x, by.y, by.z);
}

/// The same, in doubles if these are certain.
IST_HD inline Determinant determinant(const Point& r1, const Point& r0, const Point& u1,
                                      const Point& u0, const Point& v1, const Point& v0, int moved,
                                      const Point& aside) {
  const Determinant found = filtered_determinant(r1, r0, u1, u0, v1, v0, moved, aside);
  return found.sign != 0 ? found : exact_determinant(r1, r0, u1, u0, v1, v0, moved, aside);
}

/// Computed in doubles, with a sign that may be 0; or exactly, with `kExactly`.
template <bool kExactly>
IST_HD inline Determinant determinant_of(const Point& r1, const Point& r0, const Point& u1,
                                         const Point& u0, const Point& v1, const Point& v0,
                                         int moved, const Point& aside) {
  if constexpr (kExactly)
    return determinant(r1, r0, u1, u0, v1, v0, moved, aside);
  else
    return FilteredPlane(u1 - u0, v1 - v0, moved * aside).height(r1 - r0);
}

/// The height of B's point above triangle A's plane: > 0 outside.
template <bool kExactly = true>
IST_HD inline Determinant height_over_a(const Point (&a)[3], const Point& b, const Point& aside) {
  return determinant_of<kExactly>(b, a[0], a[1], a[0], a[2], a[0], 1, aside);
}

/// The height of A's point above triangle B's plane.
template <bool kExactly = true>
IST_HD inline Determinant height_over_b(const Point (&b)[3], const Point& a, const Point& aside) {
  return determinant_of<kExactly>(a, b[0], b[1], b[0], b[2], b[0], -1, aside);
}

/// The orientation of A's edge p → q about B's edge r → s.
template <bool kExactly = true>
IST_HD inline Determinant edge_orientation(const Point& p, const Point& q, const Point& r,
                                           const Point& s, const Point& aside) {
  return determinant_of<kExactly>(r, p, q, p, s, r, 1, aside);
}

/// +1 if the edge p → q enters the other solid through the plane, −1 if it leaves.
IST_HD inline int direction(int sign_p) { return sign_p > 0 ? 1 : -1; }

/// True if triangles of A and B cross, with B not translated.
IST_HD inline bool cross_exactly(const Point (&a)[3], const Point (&b)[3]) {
  const Point still = {0, 0, 0};
  int height[2][3];
  const auto alike = [](const int(&h)[3]) { return h[0] == h[1] && h[1] == h[2]; };
  for (int k = 0; k < 3; ++k) height[1][k] = height_over_a(a, b[k], still).sign;
  if (alike(height[1])) return false;
  for (int k = 0; k < 3; ++k) height[0][k] = height_over_b(b, a[k], still).sign;
  if (alike(height[0])) return false;
  const auto round = [&](int i, int j) {
    return edge_orientation(a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3], still).sign;
  };
  for (int k = 0; k < 3; ++k) {
    if (height[0][k] != height[0][(k + 1) % 3] && round(k, 0) == round(k, 1) &&
        round(k, 1) == round(k, 2))
      return true;
    if (height[1][k] != height[1][(k + 1) % 3] && round(0, k) == round(1, k) &&
        round(1, k) == round(2, k))
      return true;
  }
  return false;
}

/// 1 if the line from p to q, two points of B or of A, enters the other solid through one of its
/// triangles, −1 if it leaves, else 0. `unsure`: doubles do not decide, without `kExactly`.
template <bool kExactly = true>
IST_HD inline int enters(const Point& p, const Point& q, const Point (&t)[3], bool of_b,
                         const Point& aside, bool& unsure) {
  int sign[2], sense[3];
  bool all = true;
  for (int k = 0; k < 2; ++k) {
    sign[k] = (of_b ? height_over_a<kExactly>(t, k == 0 ? p : q, aside)
                    : height_over_b<kExactly>(t, k == 0 ? p : q, aside))
                  .sign;
    all = all && sign[k] != 0;
  }
  if (all && sign[0] == sign[1]) return 0;
  for (int k = 0; k < 3; ++k) {
    sense[k] = (of_b ? edge_orientation<kExactly>(t[k], t[(k + 1) % 3], p, q, aside)
                     : edge_orientation<kExactly>(p, q, t[k], t[(k + 1) % 3], aside))
                   .sign;
    all = all && sense[k] != 0;
  }
  // Two different signs prove that the line misses the triangle, whatever the third sign is.
  const int least = sense[0] < sense[1] ? (sense[0] < sense[2] ? sense[0] : sense[2])
                                        : (sense[1] < sense[2] ? sense[1] : sense[2]);
  const int most = sense[0] > sense[1] ? (sense[0] > sense[2] ? sense[0] : sense[2])
                                       : (sense[1] > sense[2] ? sense[1] : sense[2]);
  if (least < 0 && most > 0) return 0;
  unsure = unsure || !all;
  return all ? direction(sign[0]) : 0;
}
IST_HD inline int enters(const Point& p, const Point& q, const Point (&t)[3], bool of_b,
                         const Point& aside) {
  bool unsure = false;
  return enters<true>(p, q, t, of_b, aside, unsure);
}

}  // namespace ist::exact
