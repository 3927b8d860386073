#pragma once

#include <cmath>
#include <cstdint>

#include "cuda/query/disc_part.h"
#include "cuda/query/field_ref.h"
#include "cuda/query/lens_sums.h"
#include "cuda/query/part_sums.h"
#include "numerics/host_device.h"

// Fields as a descent looks at them, the shapes of query/field/shapes.h in plain numbers: look()
// tells the distance, positive inside and never more than the true one; part() what of a ball is
// inside.

namespace ist::gpu {

/// What of a ball is inside a field.
struct PartInside {
  double volume;
  double gradient[3];  ///< by the centre
  double moment[3];    ///< about it
};

struct DistanceLook {
  double distance;
  double gradient[3];
};

/// A ball of radius r cut by a plane (query/probe/cap.h).
struct FlatCap {
  double volume, derivative, moment;

  IST_HD FlatCap(double r, double d) : volume(0), derivative(0), moment(0) {
    if (!(d > -r)) return;
    const double whole = 4 * kPi / 3 * (r * r * r);
    volume = whole;
    if (d >= r) return;
    const double circle = (r - d) * (r + d);
    const double h = d < 0 ? r + d : r - d;
    const double small = kPi / 3 * (h * h) * (3 * r - h);
    volume = d < 0 ? small : whole - small;
    derivative = kPi * circle;
    moment = kPi / 4 * (circle * circle);
  }
};

IST_HD inline PartInside flat_part(const DistanceLook& at, double r) {
  const FlatCap cap(r, at.distance);
  PartInside part = {cap.volume, {}, {}};
  for (int k = 0; k < 3; ++k) {
    part.gradient[k] = cap.derivative * at.gradient[k];
    part.moment[k] = cap.moment * at.gradient[k];
  }
  return part;
}

IST_HD inline double clamped(double x, double low, double high) {
  return x < low ? low : x > high ? high : x;
}

IST_HD inline DistanceLook look_at(const HalfSpaceRef& f, const double (&x)[3]) {
  return {f.offset - ((f.normal[0] * x[0] + f.normal[1] * x[1]) + f.normal[2] * x[2]),
          {-f.normal[0], -f.normal[1], -f.normal[2]}};
}

IST_HD inline DistanceLook look_at_capsule(const RoundRef& f, const double (&x)[3]) {
  const double away[3] = {x[0], x[1], x[2] - clamped(x[2], -f.half, f.half)};
  const double d = sqrt((away[0] * away[0] + away[1] * away[1]) + away[2] * away[2]);
  const double per = d > 0 ? -1 / d : 0;
  return {f.radius - d, {per * away[0], per * away[1], per * away[2]}};
}

IST_HD inline double across(const double (&x)[3]) { return sqrt(x[0] * x[0] + x[1] * x[1]); }

/// Past the rim the farther of mantle and end.
IST_HD inline double distance_in_cylinder(const RoundRef& f, const double (&x)[3]) {
  return -most(across(x) - f.radius, size_of(x[2]) - f.half);
}

/// A lens, as lens() of query/kernel/lens.h: the sums g, f and e are not to be re-associated.
IST_HD inline PartInside part_of_ball(const RoundRef& f, const double (&x)[3], double r) {
  const double d = sqrt((x[0] * x[0] + x[1] * x[1]) + x[2] * x[2]);
  const bool field_is_larger = f.radius > r;
  const double a = field_is_larger ? f.radius : r, b = field_is_larger ? r : f.radius;
  const double g = most(0, (a - d) + b);
  const double out = a - b <= b ? d - (a - b) : (d - a) + b;
  const bool holds = out <= 0 || d < 2.2250738585072014e-308;
  const double inverse = 0.5 / (holds ? 1 : d);
  const double ha = holds ? 0 : (out * inverse) * g;
  const double full = (((a - b) + d) * inverse) * g;
  const double hb = g > 0 && (holds || full > 2 * b) ? 2 * b : full;
  const double large = (ha * ha) * (3 * a - ha), small = (hb * hb) * (3 * b - hb);
  const double volume = kPi / 3 * (large + small);
  const double of_field = kPi / 3 * (field_is_larger ? large : small);
  const double push = d > 0 ? -kPi * (ha * (2 * a - ha)) / d : 0;
  // The caps' moments about their centres cancel, so that only the field's is off the ball's.
  const double shift = -of_field;
  return {
      volume, {push * x[0], push * x[1], push * x[2]}, {shift * x[0], shift * x[1], shift * x[2]}};
}

/// The share of the mantle times that of the slab between the ends.
IST_HD inline PartInside part_of_cylinder(const RoundRef& f, const double (&x)[3], double r) {
  const double whole = 4 * kPi / 3 * (r * r * r);
  const double d = across(x);
  const FlatCap mantle(r, f.radius - d), top(r, f.half - x[2]), bottom(r, f.half + x[2]);
  const double slab = most(0, top.volume + bottom.volume - whole);
  const double a = mantle.volume / whole, b = slab / whole;
  const double per = d > 0 ? -1 / d : 0;
  const double push = mantle.derivative * b * per, shift = mantle.moment * b * per;
  return {whole * a * b,
          {push * x[0], push * x[1], slab > 0 ? a * (bottom.derivative - top.derivative) : 0},
          {shift * x[0], shift * x[1], a * (bottom.moment - top.moment)}};
}

/// Linear interpolation in the grid's cells; outside the way to the grid. `sound` becomes false
/// where it holds what is no number.
IST_HD inline DistanceLook look_at(const GridRef& f, const double (&x)[3], bool& sound) {
  double t[3], beyond[3], away2 = 0;
  std::uint64_t cell[3];
  for (int k = 0; k < 3; ++k) {
    const double at = (x[k] - f.origin[k]) / f.spacing;
    const double held = clamped(at, 0, f.size[k] - 1.0);
    beyond[k] = (at - held) * f.spacing;
    away2 += beyond[k] * beyond[k];
    const auto whole = static_cast<std::uint64_t>(held);
    cell[k] = whole < f.size[k] - 2 ? whole : f.size[k] - 2;
    t[k] = held - static_cast<double>(cell[k]);
  }
  const std::uint64_t nx = f.size[0], nxy = nx * f.size[1];
  const float* const from = f.distances + (cell[0] + nx * cell[1] + nxy * cell[2]);
  double c[2][2][2], e[2][2], g[2];
  for (std::uint64_t k = 0; k < 2; ++k)
    for (std::uint64_t j = 0; j < 2; ++j)
      for (std::uint64_t i = 0; i < 2; ++i)
        c[k][j][i] = static_cast<double>(from[i + nx * j + nxy * k]);
  const auto mix = [](double a, double b, double s) { return a + s * (b - a); };
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j) e[k][j] = mix(c[k][j][0], c[k][j][1], t[0]);
  for (int k = 0; k < 2; ++k) g[k] = mix(e[k][0], e[k][1], t[1]);
  DistanceLook at = {mix(g[0], g[1], t[2]), {}};
  const double away = sqrt(away2);
  if (away > 0) {
    at.distance = least(at.distance, 0) - away;
    for (int k = 0; k < 3; ++k) at.gradient[k] = -beyond[k] / away;
  } else {
    const auto slope = [&](int k, int j) { return c[k][j][1] - c[k][j][0]; };
    at.gradient[0] =
        mix(mix(slope(0, 0), slope(0, 1), t[1]), mix(slope(1, 0), slope(1, 1), t[1]), t[2]);
    at.gradient[1] = mix(e[0][1] - e[0][0], e[1][1] - e[1][0], t[2]);
    at.gradient[2] = g[1] - g[0];
    for (double& gradient : at.gradient) gradient /= f.spacing;
  }
  const double square = (at.gradient[0] * at.gradient[0] + at.gradient[1] * at.gradient[1]) +
                        at.gradient[2] * at.gradient[2];
  if (!(size_of(at.distance) <= 1e150) || !(square <= 1e300)) {
    sound = false;
    at = {-1e150, {0, 0, 0}};
  }
  return at;
}

IST_HD inline double distance_in_box(const BoxRef& f, const double (&x)[3]) {
  double deepest = size_of(x[0]) - f.half[0], square = 0;
  for (int k = 0; k < 3; ++k) {
    const double beyond = size_of(x[k]) - f.half[k];
    deepest = most(deepest, beyond);
    square += beyond > 0 ? beyond * beyond : 0;
  }
  return deepest <= 0 ? -deepest : -sqrt(square);
}

/// What is beyond all heights is told at once; 0: only a closer look tells.
IST_HD inline double distance_in_terrain(const HeightRef& f, const double (&x)[3]) {
  double distance = 0;
  if (x[2] > f.highest) distance = f.highest - x[2];
  if (x[2] < f.lowest) distance = f.lowest - x[2];
  return distance;
}

/// No nearer to the surface than this, positive inside; of all fields but meshes.
IST_HD inline double distance_in(const FieldRef& field, const double (&x)[3], bool& sound) {
  switch (field.kind) {
    case FieldKind::half_space:
      return look_at(field.half_space, x).distance;
    case FieldKind::ball:
      return field.round.radius - sqrt((x[0] * x[0] + x[1] * x[1]) + x[2] * x[2]);
    case FieldKind::capsule:
      return look_at_capsule(field.round, x).distance;
    case FieldKind::cylinder:
      return distance_in_cylinder(field.round, x);
    case FieldKind::grid:
      return look_at(field.grid, x, sound).distance;
    case FieldKind::box:
      return distance_in_box(field.box, x);
    case FieldKind::height:
      return distance_in_terrain(field.height, x);
    default:
      return 0;
  }
}

/// By how much distances may be off.
IST_HD inline double distance_error(const FieldRef& field) {
  return field.kind == FieldKind::grid ? field.grid.error : 0;
}

/// Of the smooth fields (kSmooth).
IST_HD inline PartInside part_in(const FieldRef& field, const double (&x)[3], double r,
                                 bool& sound) {
  switch (field.kind) {
    case FieldKind::half_space:
      return flat_part(look_at(field.half_space, x), r);
    case FieldKind::ball:
      return part_of_ball(field.round, x, r);
    case FieldKind::capsule:
      return flat_part(look_at_capsule(field.round, x), r);
    case FieldKind::cylinder:
      return part_of_cylinder(field.round, x, r);
    case FieldKind::grid:
      return flat_part(look_at(field.grid, x, sound), r);
    default:
      return {};
  }
}

}  // namespace ist::gpu
