#pragma once

#include <numbers>

#include "base/plain.h"

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

}  // namespace ist
