#pragma once

#include <cmath>

#include "query/asset/node_ball.h"
#include "query/base/pair_place.h"

namespace ist {

/// Arithmetic inside a block is in float unless one solid is far smaller than the other.
enum class Precision { float32, float64 };

/// Bound on the rounding of a distance between points with coordinates of this magnitude: each
/// coordinate takes a three-term product, a sum and a difference.
IST_HD constexpr double distance_error(Precision precision, double magnitude) {
  return 12 * (precision == Precision::float32 ? 0x1p-24 : 0x1p-53) * magnitude;
}
template <class T>
IST_HD constexpr double distance_error(double magnitude) {
  return distance_error(sizeof(T) == sizeof(float) ? Precision::float32 : Precision::float64,
                        magnitude);
}

/// `scale`: of B in A's unit frame.
IST_HD inline Precision precision_for(const RootBall& a, const RootBall& b, double scale) noexcept {
  const double rb = b.r * scale;
  return rb <= kSingleRatio * a.r && a.r <= kSingleRatio * rb ? Precision::float32
                                                              : Precision::float64;
}

/// The diameter of a region that contains both trees, A's unit frame.
IST_HD inline double span(const RootBall& a, const RootBall& b,
                          const Similarity& a_from_b) noexcept {
  double moved[3], sum = 0;
  a_from_b.apply(b.centre, moved);
  for (int i = 0; i < 3; ++i) sum += std::abs(moved[i] - a.centre[i]);
  return sum + 2 * (a.reach() + a_from_b.scale * b.reach());
}

/// A gap's rounding grows with the distance of blocks: float serves up to a few sizes of solids.
IST_HD inline Precision precision_for_gap(const RootBall& a, const RootBall& b,
                                          const Similarity& a_from_b) noexcept {
  const double sizes = a.r + a_from_b.scale * b.r;
  return span(a, b, a_from_b) <= kSingleRatio * sizes ? precision_for(a, b, a_from_b.scale)
                                                      : Precision::float64;
}

}  // namespace ist
