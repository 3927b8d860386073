#pragma once

#include <cmath>

#include "mesh/host_device.h"

namespace ist {

/// A triangle in its own orthonormal frame: origin at one end of its longest edge, u along that
/// edge, v towards the third corner, n = u × v. In it the corners are (0, 0), (length, 0) and
/// (apex, height), the angles at the first two are acute, and a distance to the triangle is a
/// problem in the plane. Built on the longest edge, the frame is accurate for needles and caps
/// too: an error of the direction v is worth at most ε · length over the triangle's height.
template <class Real>
struct TriangleFrame {
  Real origin[3];
  Real u[3], v[3], n[3];
  Real length, apex, height;
};

/// The closest point of a triangle in its frame.
template <class Real>
struct FramePoint {
  Real x, y;       ///< of the closest point, along u and v
  Real distance2;  ///< squared distance from the query
};

template <class Real>
IST_HD inline Real dot3(const Real a[3], const Real b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class Real>
IST_HD TriangleFrame<Real> make_triangle_frame(const Real a[3], const Real b[3], const Real c[3]) {
  const Real* corner[3] = {a, b, c};
  int longest = 0;
  Real longest2 = -1;
  for (int i = 0; i < 3; ++i) {
    const Real* p = corner[i];
    const Real* q = corner[(i + 1) % 3];
    const Real e[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
    const Real e2 = dot3(e, e);
    if (e2 > longest2) {
      longest2 = e2;
      longest = i;
    }
  }
  const Real* p = corner[longest];
  const Real* q = corner[(longest + 1) % 3];
  const Real* r = corner[(longest + 2) % 3];
  TriangleFrame<Real> f = {{p[0], p[1], p[2]}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0, 0, 0};
  f.length = std::sqrt(longest2);
  if (!(f.length > 0)) return f;  // a single point: any frame will do
  for (int k = 0; k < 3; ++k) f.u[k] = (q[k] - p[k]) / f.length;
  Real w[3] = {r[0] - p[0], r[1] - p[1], r[2] - p[2]};
  f.apex = dot3(w, f.u);
  Real along = f.apex;
  for (int pass = 0; pass < 2; ++pass) {  // twice is enough (Kahan)
    for (int k = 0; k < 3; ++k) w[k] -= along * f.u[k];
    along = dot3(w, f.u);
  }
  f.height = std::sqrt(dot3(w, w));
  if (f.height > 0) {
    for (int k = 0; k < 3; ++k) f.v[k] = w[k] / f.height;
  } else {  // a segment: any direction across it will do
    const Real x = std::abs(f.u[0]), y = std::abs(f.u[1]), z = std::abs(f.u[2]);
    const int axis = x <= y && x <= z ? 0 : (y <= z ? 1 : 2);
    const int j = (axis + 1) % 3, k = (axis + 2) % 3;
    const Real across = std::sqrt(f.u[j] * f.u[j] + f.u[k] * f.u[k]);
    f.v[axis] = 0;
    f.v[j] = -f.u[k] / across;
    f.v[k] = f.u[j] / across;
  }
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    f.n[k] = f.u[i] * f.v[j] - f.u[j] * f.v[i];
  }
  return f;
}

/// Closest point of the triangle (0, 0), (length, 0), (apex, height) to (x, y), z off its plane.
/// Free of branches, so that lanes of triangles run it side by side with the same bits.
template <class Real>
IST_HD inline FramePoint<Real> closest_in_frame(Real x, Real y, Real z, Real length, Real apex,
                                                Real height) {
  const Real smallest = Real(1e-37);  // only keeps 0 / 0 away: collapsed edges give t = 0
  const Real left = apex - length;
  const Real from_b = x - length;
  // Below the longest edge, both angles at it being acute, the closest point is on that edge.
  const Real x_ab = x < 0 ? Real(0) : (x > length ? length : x);
  // The two other edges, from either end of the longest one to the apex.
  const Real ac2 = apex * apex + height * height;
  const Real bc2 = left * left + height * height;
  const Real t_ac = (x * apex + y * height) / (ac2 > smallest ? ac2 : smallest);
  const Real t_bc = (from_b * left + y * height) / (bc2 > smallest ? bc2 : smallest);
  const Real s_ac = t_ac < 0 ? Real(0) : (t_ac > 1 ? Real(1) : t_ac);
  const Real s_bc = t_bc < 0 ? Real(0) : (t_bc > 1 ? Real(1) : t_bc);
  const Real x_ac = s_ac * apex, y_ac = s_ac * height;
  const Real x_bc = length + s_bc * left, y_bc = s_bc * height;
  const Real d_ac = (x - x_ac) * (x - x_ac) + (y - y_ac) * (y - y_ac);
  const Real d_bc = (x - x_bc) * (x - x_bc) + (y - y_bc) * (y - y_bc);
  const bool ac = d_ac <= d_bc;
  const bool below = y <= 0;
  const bool inside = (height > 0) & (y * apex <= x * height) & (from_b * height <= y * left);
  Real px = ac ? x_ac : x_bc;
  Real py = ac ? y_ac : y_bc;
  px = inside ? x : px;
  py = inside ? y : py;
  px = below ? x_ab : px;
  py = below ? Real(0) : py;
  const Real dx = x - px, dy = y - py;
  return {px, py, z * z + (dx * dx + dy * dy)};
}

/// Closest point of a triangle to p. Error of the distance: a few roundings of |p − origin| +
/// length, whatever the triangle's shape.
template <class Real>
IST_HD inline FramePoint<Real> closest_in_frame(const TriangleFrame<Real>& f, const Real p[3]) {
  const Real d[3] = {p[0] - f.origin[0], p[1] - f.origin[1], p[2] - f.origin[2]};
  return closest_in_frame(dot3(d, f.u), dot3(d, f.v), dot3(d, f.n), f.length, f.apex, f.height);
}

}  // namespace ist
