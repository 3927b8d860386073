#pragma once

#include <ist/shapes.h>
#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "query/asset/shared_constants.h"
#include "query/shape/plain_shapes.h"

// Samplers of the shapes of ist/shapes.h, for traversals on the CPU.

namespace ist {

// Validation of shapes, except for the arrays they point to; the same for CPU and GPU.

inline bool is_length(double x) noexcept { return x > 0 && x <= kLongestLength; }
inline bool is_extent(double x) noexcept { return x >= 0 && x <= kLongestLength; }
inline bool is_side(std::uint32_t points) noexcept { return points >= 2 && points <= 1u << 20; }

inline bool is_sound(const HalfSpaceShape& f) noexcept {
  const double length = f.normal.norm();
  return length >= kShortestDirection && length <= kLongestDirection &&
         std::abs(f.offset / length) <= kLongestLength;
}
inline bool is_sound(const BoxShape& f) noexcept {
  return is_length(f.half_extents[0]) && is_length(f.half_extents[1]) &&
         is_length(f.half_extents[2]);
}
inline bool is_sound(const BallShape& f) noexcept { return is_length(f.radius); }
inline bool is_sound(const CapsuleShape& f) noexcept {
  return is_length(f.radius) && is_extent(f.half_height);
}
inline bool is_sound(const CylinderShape& f) noexcept {
  return is_length(f.radius) && is_length(f.half_height);
}
inline bool is_sound(const HeightFieldShape& f) noexcept {
  return f.heights != nullptr && is_side(f.columns) && is_side(f.rows) && is_length(f.spacing[0]) &&
         is_length(f.spacing[1]) && f.lowest <= f.highest;
}
inline bool is_sound(const DistanceGridShape& f) noexcept {
  return f.distances != nullptr && is_length(f.spacing) && is_extent(f.error) &&
         f.origin.allFinite() && is_side(f.size[0]) && is_side(f.size[1]) && is_side(f.size[2]);
}
inline bool is_sound(const FunctionShape& f) noexcept {
  return f.sample != nullptr && is_extent(f.error);
}

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
