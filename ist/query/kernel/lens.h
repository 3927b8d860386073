#pragma once

#include <limits>
#include <numbers>

#include "base/host_device.h"

namespace ist {

/// The overlap of two balls. `circle` is the squared radius of the circle in which their surfaces
/// intersect, so dV/dd = −π · circle; it is 0 if one ball contains the other or they are disjoint.
template <class T>
struct Lens {
  T cap_a = 0;   ///< 3/π times the volume of ball A's cap, on B's side of the circle's plane
  T cap_b = 0;   ///< likewise of ball B's; the lens is both caps
  T circle = 0;  ///< squared radius

  IST_HD T volume() const { return T(std::numbers::pi / 3) * (cap_a + cap_b); }
  /// dV/d(centre distance)
  IST_HD T derivative() const { return -T(std::numbers::pi) * circle; }
};

template <class T>
inline constexpr T kSmallestNormal = std::numeric_limits<T>::min();

/// The lens of balls of radii `ra`, `rb` ≥ 0 at centre distance `d` ≥ 0. The sums g, f, e must not
/// be re-associated: in this order none loses digits at any ratio of radii, near tangency or near
/// coincidence (docs/design.md 3.5; f has two forms, because d − a is exact only if d is of a's
/// size, and a − b only if b is). The moments of the caps about their balls' centres are π/4 ·
/// circle² along the axis and opposite, so the lens's centroid is (cap_a · centre_a + cap_b ·
/// centre_b) / (cap_a + cap_b).
template <class T>
IST_HD Lens<T> lens(T ra, T rb, T d) {
  const T a = ra > rb ? ra : rb;
  const T b = ra > rb ? rb : ra;
  const T g = (a - d) + b;
  const T f = a - b <= b ? d - (a - b) : (d - a) + b;
  const T e = (a - b) + d;
  if (!(g > 0)) return {};
  // Below the smallest normal number 1/(2d) overflows, and equal balls coincide to rounding.
  const bool contained = f <= 0 || d < kSmallestNormal<T>;
  const T inverse = T(0.5) / (contained ? T(1) : d);
  const T ha = contained ? T(0) : (f * inverse) * g;
  const T full = (e * inverse) * g;
  const T hb = contained || T(2) * b < full ? T(2) * b : full;
  const T cap_large = (ha * ha) * (T(3) * a - ha);
  const T cap_small = (hb * hb) * (T(3) * b - hb);
  const T circle = ha * (T(2) * a - ha);
  return ra > rb ? Lens<T>{cap_large, cap_small, circle} : Lens<T>{cap_small, cap_large, circle};
}

}  // namespace ist
