#pragma once

#include <cmath>
#include <cstdint>

#include <ist/shapes.h>

#include "query/asset/shared_constants.h"

// Validation of shapes, except for the arrays they point to; the same for CPU and GPU.

namespace ist {

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

}  // namespace ist
