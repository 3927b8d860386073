#pragma once

#include <Eigen/Core>
#include <cmath>

#include <ist/field.h>

#include "query/field/plain_shapes.h"
#include "query/field/sound_fields.h"

// The fields of ist/field.h as the descents on the CPU sample them.

namespace ist {

inline PlainHalfSpace plain(const HalfSpaceField& f) noexcept {
  const double length = f.normal.norm();
  return {{f.normal[0] / length, f.normal[1] / length, f.normal[2] / length}, f.offset / length};
}
inline PlainBox plain(const BoxField& f) noexcept {
  return {{f.half_extents[0], f.half_extents[1], f.half_extents[2]}};
}
inline PlainBall plain(const BallField& f) noexcept { return {f.radius}; }
inline PlainCapsule plain(const CapsuleField& f) noexcept { return {f.radius, f.half_height}; }
inline PlainCylinder plain(const CylinderField& f) noexcept { return {f.radius, f.half_height}; }
inline PlainTerrain plain(const HeightField& f) noexcept {
  return {f.heights, f.columns, f.rows, {f.spacing[0], f.spacing[1]}, f.lowest, f.highest};
}
inline PlainGrid plain(const DistanceGridField& f) noexcept {
  return {f.distances,
          {f.size[0], f.size[1], f.size[2]},
          {f.origin[0], f.origin[1], f.origin[2]},
          f.spacing,
          f.error};
}

/// A plain shape with all that a descent calls.
template <class Plain>
struct ShapeOf : Plain {
  [[gnu::always_inline]] explicit ShapeOf(const auto& field) noexcept
      : Plain(plain(field)), sound(is_sound(field)) {}

  FieldSample sample(const Eigen::Vector3d& x) noexcept { return eigen(seen({x[0], x[1], x[2]})); }
  [[gnu::always_inline]] FieldSample nearest(const Eigen::Vector3d& x) noexcept {
    const double at[3] = {x[0], x[1], x[2]};
    if constexpr (requires { Plain::nearest(at); })
      return eigen(Plain::nearest(at));
    else
      return eigen(seen(at));
  }
  BallPart part(const Eigen::Vector3d& x, double r) noexcept {
    const double at[3] = {x[0], x[1], x[2]};
    if constexpr (requires { Plain::part(at, r); })
      return Plain::part(at, r);
    else
      return flat_part(seen(at), r);
  }
  double error() const noexcept {
    if constexpr (requires { Plain::error; })
      return Plain::error;
    else
      return 0;
  }

  bool sound;  ///< no longer once the field gives what is no number: the query's input is invalid

 private:
  DistanceSample seen(const double (&x)[3]) noexcept {
    if constexpr (requires { Plain::sample(x, sound); })
      return Plain::sample(x, sound);
    else
      return Plain::sample(x);
  }
  static FieldSample eigen(const DistanceSample& at) noexcept {
    return {at.distance, Eigen::Vector3d(at.gradient)};
  }
};

using HalfSpaceShape = ShapeOf<PlainHalfSpace>;
using BallShape = ShapeOf<PlainBall>;
using CapsuleShape = ShapeOf<PlainCapsule>;
using CylinderShape = ShapeOf<PlainCylinder>;
using GridShape = ShapeOf<PlainGrid>;

/// A caller's function. What it says that is no number makes the query's input invalid.
struct FunctionShape {
  explicit FunctionShape(const FunctionField& f) noexcept : field(f), sound(is_sound(f)) {}
  FieldSample sample(const Eigen::Vector3d& x) noexcept {
    FieldSample at = field.sample(field.context, x);
    if (!(std::abs(at.distance) <= kLongestLength) || !(at.gradient.squaredNorm() <= 1e6)) {
      sound = false;
      at = FieldSample{kLongestLength, Eigen::Vector3d::Zero()};
    }
    return at;
  }
  FieldSample nearest(const Eigen::Vector3d& x) noexcept { return sample(x); }
  BallPart part(const Eigen::Vector3d& x, double r) noexcept {
    const FieldSample at = sample(x);
    return flat_part({at.distance, {at.gradient[0], at.gradient[1], at.gradient[2]}}, r);
  }
  double error() const noexcept { return field.error; }

  const FunctionField& field;
  bool sound;
};

}  // namespace ist
