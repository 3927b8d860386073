#pragma once

#include <algorithm>
#include <cmath>

#include "query/asset/sphere_tree.h"
#include "query/base/relative_pose.h"

namespace ist {

/// Digits of the arithmetic inside a block. Float serves unless one object is far smaller than the
/// other.
enum class Precision { float32, float64 };

/// How far rounding may move a distance that is computed from coordinates of this magnitude: each
/// coordinate comes out of a three-term product, a sum and a difference, then a norm.
constexpr double distance_error(Precision precision, double magnitude) {
  return 12 * (precision == Precision::float32 ? 0x1p-24 : 0x1p-53) * magnitude;
}
template <class T>
constexpr double distance_error(double magnitude) {
  return distance_error(sizeof(T) == sizeof(float) ? Precision::float32 : Precision::float64,
                        magnitude);
}

inline Precision precision_for(const SphereTree& a, const SphereTree& b,
                               const RelativePose& pose) noexcept {
  const double ra = a.header->root[3];
  const double rb = b.header->root[3] * pose.a_from_b.scale;
  return rb <= kSingleRatio * ra && ra <= kSingleRatio * rb ? Precision::float32
                                                            : Precision::float64;
}

/// Length within which all of both trees and the way between them lie, A's unit frame.
inline double span(const SphereTree& a, const SphereTree& b, const RelativePose& pose) noexcept {
  double moved[3];
  pose.a_from_b.apply({b.header->root[0], b.header->root[1], b.header->root[2]}, moved);
  double sum = 0;
  for (int i = 0; i < 3; ++i) sum += std::abs(moved[i] - a.header->root[i]);
  return sum + 2 * (std::max(a.header->root[3], a.header->root_cover) +
                    pose.a_from_b.scale * std::max(b.header->root[3], b.header->root_cover));
}

/// A gap is measured from block to block, and its rounding grows with the way between: float as
/// long as that is no more than a few sizes of the objects.
inline Precision precision_for_gap(const SphereTree& a, const SphereTree& b,
                                   const RelativePose& pose) noexcept {
  const double sizes = a.header->root[3] + pose.a_from_b.scale * b.header->root[3];
  return span(a, b, pose) <= kSingleRatio * sizes ? precision_for(a, b, pose) : Precision::float64;
}

}  // namespace ist
