#pragma once

#include <Eigen/Core>
#include <cmath>

#include <ist/shapes.h>

#include "query/shape/plain_shapes.h"
#include "query/shape/sound_shapes.h"

// Samplers of the shapes of ist/shapes.h, for traversals on the CPU.

namespace ist {

inline PlainHalfSpace plain(const HalfSpaceShape& f) noexcept {
  const double length = f.normal.norm();
  return {{f.normal[0] / length, f.normal[1] / length, f.normal[2] / length}, f.offset / length};
}
inline PlainBox plain(const BoxShape& f) noexcept {
  return {{f.half_extents[0], f.half_extents[1], f.half_extents[2]}};
}
inline PlainBall plain(const BallShape& f) noexcept { return {f.radius}; }
inline PlainCapsule plain(const CapsuleShape& f) noexcept { return {f.radius, f.half_height}; }
inline PlainCylinder plain(const CylinderShape& f) noexcept { return {f.radius, f.half_height}; }
inline PlainTerrain plain(const HeightFieldShape& f) noexcept {
  return {f.heights, f.columns, f.rows, {f.spacing[0], f.spacing[1]}, f.lowest, f.highest};
}
inline PlainGrid plain(const DistanceGridShape& f) noexcept {
  return {f.distances,
          {f.size[0], f.size[1], f.size[2]},
          {f.origin[0], f.origin[1], f.origin[2]},
          f.spacing,
          f.error};
}

/// A plain shape with the functions that traversals call.
template <class Plain>
struct SamplerOf : Plain {
  [[gnu::always_inline]] explicit SamplerOf(const auto& shape) noexcept
      : Plain(plain(shape)), sound(is_sound(shape)) {}

  ShapeSample sample(const Eigen::Vector3d& x) noexcept { return eigen(seen({x[0], x[1], x[2]})); }
  [[gnu::always_inline]] ShapeSample nearest(const Eigen::Vector3d& x) noexcept {
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

  bool sound;  ///< false once a value of the shape is out of range: the query's input is invalid

 private:
  PlainSample seen(const double (&x)[3]) noexcept {
    if constexpr (requires { Plain::sample(x, sound); })
      return Plain::sample(x, sound);
    else
      return Plain::sample(x);
  }
  static ShapeSample eigen(const PlainSample& at) noexcept {
    return {at.distance, Eigen::Vector3d(at.gradient)};
  }
};

using HalfSpaceSampler = SamplerOf<PlainHalfSpace>;
using BallSampler = SamplerOf<PlainBall>;
using CapsuleSampler = SamplerOf<PlainCapsule>;
using CylinderSampler = SamplerOf<PlainCylinder>;
using GridSampler = SamplerOf<PlainGrid>;

/// A caller's function. Values out of range make the query's input invalid.
struct FunctionSampler {
  explicit FunctionSampler(const FunctionShape& f) noexcept : shape(f), sound(is_sound(f)) {}
  ShapeSample sample(const Eigen::Vector3d& x) noexcept {
    ShapeSample at = shape.sample(shape.context, x);
    if (!(std::abs(at.distance) <= kLongestLength) || !(at.gradient.squaredNorm() <= 1e6)) {
      sound = false;
      at = ShapeSample{kLongestLength, Eigen::Vector3d::Zero()};
    }
    return at;
  }
  ShapeSample nearest(const Eigen::Vector3d& x) noexcept { return sample(x); }
  BallPart part(const Eigen::Vector3d& x, double r) noexcept {
    const ShapeSample at = sample(x);
    return flat_part({at.distance, {at.gradient[0], at.gradient[1], at.gradient[2]}}, r);
  }
  double error() const noexcept { return shape.error; }

  const FunctionShape& shape;
  bool sound;
};

}  // namespace ist
