#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "base/host_device.h"
#include "base/vec3.h"
#include "query/asset/shared_constants.h"
#include "query/kernel/lens.h"

// The shapes of ist/shapes.h in plain numbers, the same on CPU and GPU. sample(x) is the distance,
// negative inside and never further from 0 than the true one, with its gradient. part(x, r) is the
// part of a ball inside; shapes without it use flat_part() of their sample.

namespace ist {

/// A ball of radius r cut by a plane.
struct Cap {
  double volume = 0;      ///< on the plane's inner side
  double derivative = 0;  ///< of the volume by the centre's distance: the disc's area
  double moment = 0;      ///< of the volume about the centre, along the inward normal
};

/// `d`: the centre's distance from the plane, positive inside. Relative error 1e-15 up to tangency.
IST_HD inline Cap cap(double r, double d) {
  const double pi = std::numbers::pi;
  if (!(d > -r)) return {};
  if (d >= r) return {ball_volume(r), 0, 0};
  const double circle = (r - d) * (r + d);
  const double h = d < 0 ? r + d : r - d;  // of the smaller side
  const double small = pi / 3 * (h * h) * (3 * r - h);
  return {d < 0 ? small : ball_volume(r) - small, pi * circle, pi / 4 * (circle * circle)};
}

struct PlainSample {
  double distance;
  double gradient[3];
};

/// The part of a ball inside a shape.
struct BallPart {
  double volume;
  double area;         ///< of the surface in the ball
  double gradient[3];  ///< of the volume by the centre
  double moment[3];    ///< ∫ (y − centre) dV
};

/// The part of a ball behind the tangent plane at the nearest point of the surface.
IST_HD inline BallPart flat_part(const PlainSample& at, double r) {
  const Cap in = cap(r, -at.distance);
  BallPart part = {in.volume, in.derivative, {}, {}};
  for (int k = 0; k < 3; ++k) {
    part.gradient[k] = in.derivative * -at.gradient[k];
    part.moment[k] = in.moment * -at.gradient[k];
  }
  return part;
}

/// From this distance on a ball is wholly inside or outside. `error`: of the distance.
IST_HD inline double sure_reach(double r, double error) { return r * (1 + 1e-6) + error; }

/// The sample at a point `away` from the core of a shape, which is all within `radius` of the core.
IST_HD inline PlainSample core_sample(double radius, const double (&away)[3]) {
  const double d = norm(away);
  if (!(d > 0)) return {d - radius, {}};
  return {d - radius, {away[0] / d, away[1] / d, away[2] / d}};
}

struct PlainHalfSpace {
  double normal[3];  ///< unit
  double offset;

  IST_HD PlainSample sample(const double (&x)[3]) const {
    return {dot(normal, x) - offset, {normal[0], normal[1], normal[2]}};
  }
};

struct PlainBall {
  double radius;

  IST_HD PlainSample sample(const double (&x)[3]) const { return core_sample(radius, x); }
  IST_HD BallPart part(const double (&x)[3], double r) const {
    const double d = norm(x);
    const Lens<double> both = lens(radius, r, d);
    const double push = d > 0 ? both.derivative() / d : 0;
    // Centroid: (cap_a · centre_a + cap_b · centre_b) / (cap_a + cap_b), from the ball's centre.
    const double shift = -(std::numbers::pi / 3) * both.cap_a;
    return {both.volume(),
            -both.derivative(),
            {push * x[0], push * x[1], push * x[2]},
            {shift * x[0], shift * x[1], shift * x[2]}};
  }
};

struct PlainCapsule {
  double radius, half;

  IST_HD PlainSample sample(const double (&x)[3]) const {
    const double away[3] = {x[0], x[1], x[2] - clamped(x[2], -half, half)};
    return core_sample(radius, away);
  }
};

struct PlainCylinder {
  double radius, half;

  /// Beyond the rim the larger of the distances from mantle and end, since part() is positive for a
  /// ball that reaches both, though it may miss the rim.
  IST_HD PlainSample sample(const double (&x)[3]) const {
    return {most(std::fabs(x[2]) - half, from_axis(x) - radius), {}};
  }
  IST_HD PlainSample nearest(const double (&x)[3]) const {
    const double d = from_axis(x);
    const double mantle[3] = {d > 0 ? x[0] / d : 1, d > 0 ? x[1] / d : 0, 0};
    const double end[3] = {0, 0, x[2] < 0 ? -1.0 : 1.0};
    const double side = d - radius, above = std::fabs(x[2]) - half;
    const double out = most(0, side), over = most(0, above);
    const double away = std::sqrt(out * out + over * over);
    PlainSample at = {away > 0 ? away : most(side, above), {}};
    for (int k = 0; k < 3; ++k)
      at.gradient[k] = away > 0       ? (out * mantle[k] + over * end[k]) / away
                       : side > above ? mantle[k]
                                      : end[k];
    return at;
  }
  /// The share within the mantle times the share between the ends.
  IST_HD BallPart part(const double (&x)[3], double r) const {
    const double whole = ball_volume(r);
    const double d = from_axis(x);
    const Cap mantle = cap(r, radius - d), top = cap(r, half - x[2]), bottom = cap(r, half + x[2]);
    const double slab = most(top.volume + bottom.volume - whole, 0);
    const double a = mantle.volume / whole, b = slab / whole;
    const double push = mantle.derivative * b, shift = mantle.moment * b;
    const double inward[2] = {d > 0 ? -x[0] / d : 0, d > 0 ? -x[1] / d : 0};
    return {whole * a * b,
            b * mantle.derivative + a * (top.derivative + bottom.derivative),
            {push * inward[0], push * inward[1],
             slab > 0 ? a * (bottom.derivative - top.derivative) : 0},
            {shift * inward[0], shift * inward[1], a * (bottom.moment - top.moment)}};
  }

  IST_HD static double from_axis(const double (&x)[3]) {
    return std::sqrt(x[0] * x[0] + x[1] * x[1]);
  }
};

/// Linear interpolation in the grid's cells; outside, the value at the nearest point of the grid
/// plus the distance to it.
struct PlainGrid {
  const float* distances;
  std::uint32_t size[3];
  double origin[3];
  double spacing;
  double error;

  /// Sets `sound` to false if the grid's values are not numbers in range.
  IST_HD PlainSample sample(const double (&x)[3], bool& sound) const {
    const PlainSample at = interpolated(x);
    if (std::fabs(at.distance) <= kLongestLength && dot(at.gradient, at.gradient) <= 1e300)
      return at;
    sound = false;
    return {kLongestLength, {}};
  }

 private:
  IST_HD PlainSample interpolated(const double (&x)[3]) const {
    double t[3], beyond[3];
    std::uint64_t cell[3];
    for (int k = 0; k < 3; ++k) {
      const double at = (x[k] - origin[k]) / spacing;
      const double on_grid = clamped(at, 0, size[k] - 1.0);
      beyond[k] = (at - on_grid) * spacing;
      const auto whole = static_cast<std::uint64_t>(on_grid);
      cell[k] = whole < size[k] - 2 ? whole : size[k] - 2;
      t[k] = on_grid - static_cast<double>(cell[k]);
    }
    const std::uint64_t nx = size[0], nxy = nx * size[1];
    const float* const from = distances + (cell[0] + nx * cell[1] + nxy * cell[2]);
    double c[2][2][2], e[2][2], f[2];
    for (std::uint64_t k = 0; k < 2; ++k)
      for (std::uint64_t j = 0; j < 2; ++j)
        for (std::uint64_t i = 0; i < 2; ++i)
          c[k][j][i] = static_cast<double>(from[i + nx * j + nxy * k]);
    const auto mix = [](double a, double b, double s) { return a + s * (b - a); };
    for (int k = 0; k < 2; ++k)
      for (int j = 0; j < 2; ++j) e[k][j] = mix(c[k][j][0], c[k][j][1], t[0]);
    for (int k = 0; k < 2; ++k) f[k] = mix(e[k][0], e[k][1], t[1]);
    PlainSample at = {mix(f[0], f[1], t[2]), {}};
    const double away = norm(beyond);
    if (away > 0) {
      // A point outside the grid is at least this far outside the solid.
      at.distance = most(0, at.distance) + away;
      for (int k = 0; k < 3; ++k) at.gradient[k] = beyond[k] / away;
      return at;
    }
    const auto slope = [&](int k, int j) { return c[k][j][1] - c[k][j][0]; };
    at.gradient[0] =
        mix(mix(slope(0, 0), slope(0, 1), t[1]), mix(slope(1, 0), slope(1, 1), t[1]), t[2]);
    at.gradient[1] = mix(e[0][1] - e[0][0], e[1][1] - e[1][0], t[2]);
    at.gradient[2] = f[1] - f[0];
    for (double& gradient : at.gradient) gradient /= spacing;
    return at;
  }
};

/// Six half-spaces, or twelve triangles.
struct PlainBox {
  double half[3];

  IST_HD PlainSample sample(const double (&x)[3]) const {
    double out[3] = {std::fabs(x[0]) - half[0], std::fabs(x[1]) - half[1],
                     std::fabs(x[2]) - half[2]};
    const double deepest = most(most(out[2], out[1]), out[0]);
    PlainSample at = {deepest, {}};
    if (deepest <= 0) {
      const int face = out[0] == deepest ? 0 : out[1] == deepest ? 1 : 2;
      for (int k = 0; k < 3; ++k) out[k] = k == face ? 1 : 0;
    } else {
      for (double& o : out) o = most(o, 0);
      at.distance = norm(out);
      for (double& o : out) o /= at.distance;
    }
    for (int k = 0; k < 3; ++k) at.gradient[k] = x[k] < 0 ? -out[k] : out[k];
    return at;
  }

  IST_HD bool holds(const double (&x)[3]) const {
    return std::fabs(x[0]) < half[0] && std::fabs(x[1]) < half[1] && std::fabs(x[2]) < half[2];
  }

  /// The depth of a coordinate below the face x[axis] · side = half[axis].
  IST_HD double below_face(int axis, double side, double x) const { return half[axis] - side * x; }

  /// The number of faces nearer than `reach`, and the last of them; axis −1: none.
  IST_HD int faces_near(const double (&x)[3], double reach, int& axis, double& side) const {
    int faces = 0;
    axis = -1;
    side = 1;
    for (int k = 0; k < 3; ++k) {
      for (int s = 1; s >= -1; s -= 2) {
        if (below_face(k, s, x[k]) >= reach) continue;
        ++faces;
        axis = k;
        side = s;
      }
    }
    return faces;
  }

  /// Corners of a triangle, counter-clockwise from outside.
  IST_HD void corners(std::uint32_t triangle, double (&c)[3][3]) const {
    // The corners of the faces, four bits each.
    constexpr std::uint32_t kFaces[6] = {0x2640, 0x5731, 0x4510, 0x3762, 0x1320, 0x6754};
    const std::uint32_t face = kFaces[triangle / 2], first = 1 + triangle % 2;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t corner = face >> 4 * (k == 0 ? 0 : first + k - 1);
      for (int axis = 0; axis < 3; ++axis)
        c[k][axis] = (corner >> axis & 1) != 0 ? half[axis] : -half[axis];
    }
  }
};

/// Cell (i, j) has the triangles (i, j), (i + 1, j), (i + 1, j + 1) and (i, j), (i + 1, j + 1),
/// (i, j + 1).
struct PlainTerrain {
  const float* heights;
  std::uint32_t columns, rows;
  double spacing[2];
  double lowest, highest;

  /// Nonzero only beyond all heights: between them the triangles decide.
  IST_HD PlainSample sample(const double (&x)[3]) const {
    PlainSample at = {};
    if (x[2] > highest) at.distance = x[2] - highest;
    if (x[2] < lowest) at.distance = x[2] - lowest;
    return at;
  }

  IST_HD double height(std::int64_t i, std::int64_t j) const {
    const std::int64_t last[2] = {std::int64_t{columns} - 1, std::int64_t{rows} - 1};
    i = i < 0 ? 0 : i > last[0] ? last[0] : i;
    j = j < 0 ? 0 : j > last[1] ? last[1] : j;
    return static_cast<double>(
        heights[static_cast<std::uint64_t>(j) * columns + static_cast<std::uint64_t>(i)]);
  }

  /// Height of the surface over a point. `at(i, j)`: height().
  template <class HeightAt>
  IST_HD double surface(double x, double y, const HeightAt& at) const {
    const double u = clamped(x / spacing[0], -1, columns), v = clamped(y / spacing[1], -1, rows);
    const double i = std::floor(u), j = std::floor(v), s = u - i, t = v - j;
    const auto a = static_cast<std::int64_t>(i), b = static_cast<std::int64_t>(j);
    const double low = at(a, b), high = at(a + 1, b + 1);
    const double side = s >= t ? at(a + 1, b) : at(a, b + 1);
    return s >= t ? low + s * (side - low) + t * (high - side)
                  : low + t * (side - low) + s * (high - side);
  }

  /// The cells along an axis that come near a ball. Beyond the border one cell is enough, since
  /// heights are constant across it.
  IST_HD void cells_near(int axis, double x, double reach, std::int64_t& from,
                         std::int64_t& to) const {
    const double last = (axis == 0 ? columns : rows) - 1.0;
    from = static_cast<std::int64_t>(std::floor(clamped((x - reach) / spacing[axis], -1, last)));
    to = static_cast<std::int64_t>(std::floor(clamped((x + reach) / spacing[axis], -1, last)));
  }

  /// A coordinate of grid point n. Cells at the border extend beyond a ball at x.
  IST_HD double point(int axis, std::int64_t n, double x, double reach) const {
    const std::int64_t last = std::int64_t{axis == 0 ? columns : rows} - 1;
    const double at = static_cast<double>(n) * spacing[axis];
    return n < 0 ? least(at, x - 2 * reach) : n > last ? most(at, x + 2 * reach) : at;
  }
};

}  // namespace ist
