#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include <ist/field.h>

#include "query/field/sound_fields.h"
#include "query/kernel/lens.h"
#include "query/probe/cap.h"

// The fields of ist/field.h as the descent looks at them: look(x) tells the distance, positive
// inside and never more than the true one, with its gradient; part(x, r) what of a ball is inside.

namespace ist {

/// What of a ball is inside a field.
struct BallPart {
  double volume = 0;
  double area = 0;                                     ///< of the surface in the ball
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();  ///< of the volume by the centre
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();    ///< ∫ (y − centre) dV
};

/// A ball before a plane at the closest point of the surface.
inline BallPart flat_part(const FieldSample& at, double r) noexcept {
  const Cap part = cap(r, at.distance);
  return {part.volume, part.derivative, part.derivative * at.gradient, part.moment * at.gradient};
}

inline double squared(double x) noexcept { return x * x; }

struct HalfSpaceShape {
  explicit HalfSpaceShape(const HalfSpaceField& f) noexcept
      : normal(f.normal / f.normal.norm()),
        offset(f.offset / f.normal.norm()),
        sound(is_sound(f)) {}
  FieldSample look(const Eigen::Vector3d& x) const noexcept {
    return {offset - normal.dot(x), -normal};
  }
  FieldSample nearest(const Eigen::Vector3d& x) const noexcept { return look(x); }
  BallPart part(const Eigen::Vector3d& x, double r) const noexcept { return flat_part(look(x), r); }
  double error() const noexcept { return 0; }

  Eigen::Vector3d normal;
  double offset;
  bool sound;
};

struct BallShape {
  explicit BallShape(const BallField& f) noexcept : radius(f.radius), sound(is_sound(f)) {}
  FieldSample look(const Eigen::Vector3d& x) const noexcept {
    const double d = x.norm();
    return {radius - d, d > 0 ? Eigen::Vector3d(-x / d) : Eigen::Vector3d::Zero().eval()};
  }
  FieldSample nearest(const Eigen::Vector3d& x) const noexcept { return look(x); }
  BallPart part(const Eigen::Vector3d& x, double r) const noexcept {
    const double d = x.norm();
    const Lens<double> both = lens(radius, r, d);
    const double scale = d > 0 ? both.derivative() / d : 0;
    // Centroid: (cap_a · centre_a + cap_b · centre_b) / (cap_a + cap_b), from the ball's centre.
    return {both.volume(), -both.derivative(), scale * x, -(std::numbers::pi / 3) * both.cap_a * x};
  }
  double error() const noexcept { return 0; }

  double radius;
  bool sound;
};

struct CapsuleShape {
  explicit CapsuleShape(const CapsuleField& f) noexcept
      : radius(f.radius), half(f.half_height), sound(is_sound(f)) {}
  FieldSample look(const Eigen::Vector3d& x) const noexcept {
    const Eigen::Vector3d away(x.x(), x.y(), x.z() - std::clamp(x.z(), -half, half));
    const double d = away.norm();
    return {radius - d, d > 0 ? Eigen::Vector3d(-away / d) : Eigen::Vector3d::Zero().eval()};
  }
  FieldSample nearest(const Eigen::Vector3d& x) const noexcept { return look(x); }
  BallPart part(const Eigen::Vector3d& x, double r) const noexcept { return flat_part(look(x), r); }
  double error() const noexcept { return 0; }

  double radius, half;
  bool sound;
};

/// The share of the mantle times that of the slab between the ends.
struct CylinderShape {
  explicit CylinderShape(const CylinderField& f) noexcept
      : radius(f.radius), half(f.half_height), sound(is_sound(f)) {}
  FieldSample nearest(const Eigen::Vector3d& x) const noexcept {
    const double d = std::sqrt(x.x() * x.x() + x.y() * x.y());
    const Eigen::Vector3d mantle =
        d > 0 ? Eigen::Vector3d(x.x() / d, x.y() / d, 0) : Eigen::Vector3d::UnitX().eval();
    const Eigen::Vector3d end(0, 0, x.z() < 0 ? -1 : 1);
    const double side = d - radius, above = std::abs(x.z()) - half;
    const double away = std::sqrt(squared(std::max(side, 0.0)) + squared(std::max(above, 0.0)));
    if (away > 0)
      return {-away, -(std::max(side, 0.0) * mantle + std::max(above, 0.0) * end) / away};
    return side > above ? FieldSample{-side, -mantle} : FieldSample{-above, -end};
  }
  /// Past the rim the farther of mantle and end: a ball that reaches both has a part of each,
  /// though it may miss the rim.
  FieldSample look(const Eigen::Vector3d& x) const noexcept {
    const double side = std::sqrt(x.x() * x.x() + x.y() * x.y()) - radius;
    FieldSample at;
    at.distance = -std::max(side, std::abs(x.z()) - half);
    return at;
  }
  BallPart part(const Eigen::Vector3d& x, double r) const noexcept {
    const double whole = 4 * std::numbers::pi / 3 * (r * r * r);
    const double d = std::sqrt(x.x() * x.x() + x.y() * x.y());
    const Cap mantle = cap(r, radius - d);
    const Cap top = cap(r, half - x.z()), bottom = cap(r, half + x.z());
    const double slab = std::max(0.0, top.volume + bottom.volume - whole);
    const Eigen::Vector3d inward =
        d > 0 ? Eigen::Vector3d(-x.x() / d, -x.y() / d, 0) : Eigen::Vector3d::Zero().eval();
    const double a = mantle.volume / whole, b = slab / whole;
    BallPart part;
    part.volume = whole * a * b;
    part.gradient = mantle.derivative * b * inward;
    if (slab > 0) part.gradient.z() += a * (bottom.derivative - top.derivative);
    part.moment = mantle.moment * b * inward;
    part.moment.z() += a * (bottom.moment - top.moment);
    part.area = b * mantle.derivative + a * (top.derivative + bottom.derivative);
    return part;
  }
  double error() const noexcept { return 0; }

  double radius, half;
  bool sound;
};

/// Linear interpolation in the grid's cells; outside, the nearest point of the grid and the way to
/// it. What is no number there makes the query's input invalid, once it is looked at.
struct GridShape {
  explicit GridShape(const DistanceGridField& f) noexcept : grid(f), sound(is_sound(f)) {}
  FieldSample look(const Eigen::Vector3d& x) noexcept {
    FieldSample at = interpolated(x);
    if (!(std::abs(at.distance) <= 1e150) || !(at.gradient.squaredNorm() <= 1e300)) {
      sound = false;
      at = FieldSample{-1e150, Eigen::Vector3d::Zero()};
    }
    return at;
  }
  FieldSample interpolated(const Eigen::Vector3d& x) const noexcept {
    double t[3];
    std::size_t cell[3];
    Eigen::Vector3d beyond = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      const double at = (x[k] - grid.origin[k]) / grid.spacing;
      const double last = grid.size[k] - 1;
      const double held = std::clamp(at, 0.0, last);
      beyond[k] = (at - held) * grid.spacing;
      cell[k] = std::min(static_cast<std::size_t>(held), std::size_t{grid.size[k]} - 2);
      t[k] = held - static_cast<double>(cell[k]);
    }
    const std::size_t nx = grid.size[0], nxy = nx * grid.size[1];
    const float* const from = grid.distances + cell[0] + nx * cell[1] + nxy * cell[2];
    double c[2][2][2];
    for (std::size_t k = 0; k < 2; ++k)
      for (std::size_t j = 0; j < 2; ++j)
        for (std::size_t i = 0; i < 2; ++i) c[k][j][i] = from[i + nx * j + nxy * k];
    const auto mix = [](double a, double b, double s) { return a + s * (b - a); };
    double e[2][2], f[2];
    for (int k = 0; k < 2; ++k)
      for (int j = 0; j < 2; ++j) e[k][j] = mix(c[k][j][0], c[k][j][1], t[0]);
    for (int k = 0; k < 2; ++k) f[k] = mix(e[k][0], e[k][1], t[1]);
    FieldSample at;
    at.distance = mix(f[0], f[1], t[2]);
    const double away = beyond.norm();
    if (away > 0) {
      // Whoever is outside of the grid is outside of the solid, at least so far from it.
      at.distance = std::min(at.distance, 0.0) - away;
      at.gradient = -beyond / away;
      return at;
    }
    const auto slope = [&](int k, int j) { return c[k][j][1] - c[k][j][0]; };
    at.gradient.x() =
        mix(mix(slope(0, 0), slope(0, 1), t[1]), mix(slope(1, 0), slope(1, 1), t[1]), t[2]);
    at.gradient.y() = mix(e[0][1] - e[0][0], e[1][1] - e[1][0], t[2]);
    at.gradient.z() = f[1] - f[0];
    at.gradient /= grid.spacing;
    return at;
  }
  FieldSample nearest(const Eigen::Vector3d& x) noexcept { return look(x); }
  BallPart part(const Eigen::Vector3d& x, double r) noexcept { return flat_part(look(x), r); }
  double error() const noexcept { return grid.error; }

  const DistanceGridField& grid;
  bool sound;
};

/// A caller's function. What it says that is no number makes the query's input invalid.
struct FunctionShape {
  explicit FunctionShape(const FunctionField& f) noexcept : field(f), sound(is_sound(f)) {}
  FieldSample look(const Eigen::Vector3d& x) noexcept {
    FieldSample at = field.look(field.context, x);
    if (!(std::abs(at.distance) <= 1e150) || !(at.gradient.squaredNorm() <= 1e6)) {
      sound = false;
      at = FieldSample{-1e150, Eigen::Vector3d::Zero()};
    }
    return at;
  }
  FieldSample nearest(const Eigen::Vector3d& x) noexcept { return look(x); }
  BallPart part(const Eigen::Vector3d& x, double r) noexcept { return flat_part(look(x), r); }
  double error() const noexcept { return field.error; }

  const FunctionField& field;
  bool sound;
};

}  // namespace ist
