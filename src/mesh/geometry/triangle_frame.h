#pragma once

#include <cmath>
#include <limits>

#include "base/host_device.h"

namespace ist {

/// Spacing of the numbers above 1. (Device code must not call numeric_limits' functions.)
template <class Real>
constexpr Real kSpacing = std::numeric_limits<Real>::epsilon();

/// A triangle in its own orthonormal frame: origin at one end of its longest edge, u along that
/// edge, v towards the third corner, n = u × v. In it the corners are (0, 0), (length, 0) and
/// (apex, height), the angles at the first two are acute, and a distance to the triangle is a
/// problem in the plane. Built on the longest edge, the frame is accurate for needles and caps too:
/// an error of the direction v has an effect of at most ε · length over the triangle's height.
template <class Real>
struct TriangleFrame {
  Real origin[3];
  Real u[3], v[3], n[3];
  Real length, apex, height;
};

/// The closest point of a triangle in its frame; Lane is a number or a vector of numbers.
template <class Lane>
struct FramePoint {
  Lane x, y;       ///< of the closest point, along u and v
  Lane distance2;  ///< squared distance from the query
};

template <class Real>
IST_HD inline Real dot3(const Real a[3], const Real b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class Real>
IST_HD inline void cross3(const Real a[3], const Real b[3], Real out[3]) {
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    out[k] = a[i] * b[j] - a[j] * b[i];
  }
}

/// (b − a) × (c − a): the normal of a triangle, twice its area long.
template <class Real>
IST_HD inline void area_normal(const Real a[3], const Real b[3], const Real c[3], Real out[3]) {
  const Real u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
  const Real v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
  cross3(u, v, out);
}

template <class Real>
IST_HD TriangleFrame<Real> make_triangle_frame(const Real a[3], const Real b[3], const Real c[3]) {
  // Choices instead of indices: arrays indexed at run time do not fit into a GPU's registers.
  const auto edge2 = [](const Real from[3], const Real to[3]) {
    const Real e[3] = {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
    return dot3(e, e);
  };
  const Real ab2 = edge2(a, b), bc2 = edge2(b, c), ca2 = edge2(c, a);
  const bool second = bc2 > ab2;
  const bool third = ca2 > (second ? bc2 : ab2);
  const Real longest2 = third ? ca2 : second ? bc2 : ab2;
  Real p[3], q[3], r[3];
  for (int k = 0; k < 3; ++k) {
    p[k] = third ? c[k] : second ? b[k] : a[k];
    q[k] = third ? a[k] : second ? c[k] : b[k];
    r[k] = third ? b[k] : second ? a[k] : c[k];
  }
  TriangleFrame<Real> f = {{p[0], p[1], p[2]}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0, 0, 0};
  f.length = std::sqrt(longest2);
  if (!(f.length > 0)) return f;  // a single point: any frame is valid
  for (int k = 0; k < 3; ++k) f.u[k] = (q[k] - p[k]) / f.length;
  Real w[3] = {r[0] - p[0], r[1] - p[1], r[2] - p[2]};
  f.apex = dot3(w, f.u);
  Real along = f.apex;
  for (int pass = 0; pass < 2; ++pass) {  // twice is enough (Kahan)
    for (int k = 0; k < 3; ++k) w[k] -= along * f.u[k];
    along = dot3(w, f.u);
  }
  f.height = std::sqrt(dot3(w, w));
  if (f.height > 4 * kSpacing<Real> * f.length) {
    for (int k = 0; k < 3; ++k) f.v[k] = w[k] / f.height;
  } else {  // a segment up to rounding: any perpendicular direction is valid
    f.height = 0;
    const Real x = std::abs(f.u[0]), y = std::abs(f.u[1]), z = std::abs(f.u[2]);
    const int axis = x <= y && x <= z ? 0 : (y <= z ? 1 : 2);
    const Real uj = axis == 0 ? f.u[1] : axis == 1 ? f.u[2] : f.u[0];  // the axes after it
    const Real uk = axis == 0 ? f.u[2] : axis == 1 ? f.u[0] : f.u[1];
    const Real across = std::sqrt(uj * uj + uk * uk);
    const Real vj = -uk / across, vk = uj / across;
    f.v[0] = axis == 0 ? 0 : axis == 1 ? vk : vj;
    f.v[1] = axis == 0 ? vj : axis == 1 ? 0 : vk;
    f.v[2] = axis == 0 ? vk : axis == 1 ? vj : 0;
  }
  cross3(f.u, f.v, f.n);
  return f;
}

/// The frame of a lane without a triangle: far from all points.
IST_HD inline TriangleFrame<double> absent_frame() {
  return {{1e18, 1e18, 1e18}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0, 0, 0};
}

/// Stores a rounded frame in a lane of a hierarchy's block (TriangleBlock, WideBlock).
template <class Block>
IST_HD void write_frame(Block& block, int lane, const TriangleFrame<double>& f) {
  for (int k = 0; k < 3; ++k) {
    block.origin[k][lane] = static_cast<float>(f.origin[k]);
    block.u[k][lane] = static_cast<float>(f.u[k]);
    block.v[k][lane] = static_cast<float>(f.v[k]);
    block.n[k][lane] = static_cast<float>(f.n[k]);
  }
  block.length[lane] = static_cast<float>(f.length);
  block.apex[lane] = static_cast<float>(f.apex);
  block.height[lane] = static_cast<float>(f.height);
}

/// Closest point of the triangle (0, 0), (length, 0), (apex, height) to (x, y), z off its plane.
/// Without branches: float, double and vectors of them give the same bits in every lane.
template <class Lane>
IST_HD inline FramePoint<Lane> closest_in_frame(Lane x, Lane y, Lane z, Lane length, Lane apex,
                                                Lane height) {
  const Lane zero{}, one = zero + 1;
  const Lane smallest = zero + 1e-37f;  // avoids 0 / 0: collapsed edges give t = 0
  const auto clamp = [](Lane value, Lane lower, Lane upper) {
    const Lane raised = value > lower ? value : lower;
    return raised < upper ? raised : upper;
  };
  // The edges from either end of the longest one to the apex.
  const Lane left = apex - length, from_b = x - length;
  const Lane height2 = height * height;
  const Lane ac2 = apex * apex + height2, bc2 = left * left + height2;
  const Lane rise = y * height;
  const Lane t_ac = clamp((x * apex + rise) / (ac2 > smallest ? ac2 : smallest), zero, one);
  const Lane t_bc = clamp((from_b * left + rise) / (bc2 > smallest ? bc2 : smallest), zero, one);
  const Lane x_ac = t_ac * apex, y_ac = t_ac * height;
  const Lane x_bc = length + t_bc * left, y_bc = t_bc * height;
  const Lane d_ac = (x - x_ac) * (x - x_ac) + (y - y_ac) * (y - y_ac);
  const Lane d_bc = (x - x_bc) * (x - x_bc) + (y - y_bc) * (y - y_bc);
  Lane px = d_ac <= d_bc ? x_ac : x_bc;
  Lane py = d_ac <= d_bc ? y_ac : y_bc;
  const auto inside = (height > zero) & (y * apex <= x * height) & (from_b * height <= y * left);
  px = inside ? x : px;
  py = inside ? y : py;
  // Below the longest edge, whose angles are acute, the closest point is on that edge.
  px = y <= zero ? clamp(x, zero, length) : px;
  py = y <= zero ? zero : py;
  const Lane dx = x - px, dy = y - py;
  return {px, py, z * z + (dx * dx + dy * dy)};
}

/// Closest point of a triangle to p. The error of the distance is a few roundings of |p − origin| +
/// length, whatever the triangle's shape.
template <class Real>
IST_HD inline FramePoint<Real> closest_in_frame(const TriangleFrame<Real>& f, const Real p[3]) {
  const Real d[3] = {p[0] - f.origin[0], p[1] - f.origin[1], p[2] - f.origin[2]};
  return closest_in_frame(dot3(d, f.u), dot3(d, f.v), dot3(d, f.n), f.length, f.apex, f.height);
}

}  // namespace ist
