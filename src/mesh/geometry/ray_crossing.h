#pragma once

#include <cmath>

#include "base/elementary.h"
#include "mesh/geometry/exact_sign.h"
#include "mesh/geometry/exact_triangle.h"

// Crossings of single triangles with lines parallel to x, see winding.h.

namespace ist {

/// Crossing of the edge p → q with the half-line {y > y0, z = z0} of the (y, z) plane: +1 upward,
/// −1 downward, 0 none. A corner at z0 counts as below and an edge through (y0, z0) as not
/// crossing. The edge is evaluated from its lower end, so both its triangles get the same answer.
IST_HD inline int edge_crossing(const double* p, const double* q, const double yz[2]) {
  const bool upward = !(p[2] > yz[1]);
  if (upward == !(q[2] > yz[1])) return 0;
  const double* low = upward ? p : q;
  const double* high = upward ? q : p;
  if (p[1] <= yz[0] && q[1] <= yz[0]) return 0;
  if ((p[1] <= yz[0] || q[1] <= yz[0]) && orient2d_sign(low + 1, high + 1, yz) <= 0) return 0;
  return upward ? 1 : -1;
}

/// Winding number of a triangle's outline, seen along x, about (y0, z0): the sign of its normal's x
/// if the line pierces it, else 0.
IST_HD inline int pierced(const Corners& t, const double yz[2]) {
  return edge_crossing(t.p[0], t.p[1], yz) + edge_crossing(t.p[1], t.p[2], yz) +
         edge_crossing(t.p[2], t.p[0], yz);
}

/// Extent of a triangle along an axis.
struct Extent {
  double low, high;

  IST_HD explicit Extent(const Corners& t, int axis = 0) : low(t.p[0][axis]), high(t.p[0][axis]) {
    for (int i = 1; i < 3; ++i) {
      const double x = t.p[i][axis];
      low = x < low ? x : low;
      high = x < high ? high : x;
    }
  }
};

/// The x at which the line (·, y0, z0) pierces a triangle: the corners weighted with the areas
/// opposite them. Never outside the triangle's extent in x.
IST_HD inline double crossing_x(const Corners& t, const double yz[2]) {
  double weight_sum = 0, sum = 0;
  for (int i = 0; i < 3; ++i) {
    const double* p = t.p[(i + 1) % 3];
    const double* q = t.p[(i + 2) % 3];
    const double area = (p[1] - yz[0]) * (q[2] - yz[1]) - (p[2] - yz[1]) * (q[1] - yz[0]);
    const double weight = area < 0 ? -area : area;
    weight_sum += weight;
    sum += weight * t.p[i][0];
  }
  const Extent x(t);
  if (!(weight_sum > 0)) return x.low / 2 + x.high / 2;
  const double mean = sum / weight_sum;
  return mean < x.low ? x.low : x.high < mean ? x.high : mean;
}

/// The ray points towards the nearer end: the signs on the other half of the line are negated.
IST_HD inline bool ray_towards_plus(const double p[3]) { return p[0] >= 0; }

/// True if the line through p parallel to x pierces a triangle, which faces `facing`, further along
/// +x than p.
IST_HD inline bool lies_beyond(const Corners& t, int facing, const double p[3]) {
  const Extent x(t);
  if (!(x.low <= p[0] && p[0] <= x.high)) return p[0] < x.low;
  return orient3d_sign(t.p[0], t.p[1], t.p[2], p) * facing > 0;
}

/// A triangle's term of the winding number of p.
IST_HD inline int ray_winding(const Corners& t, const double p[3]) {
  const int facing = pierced(t, p + 1);
  if (facing == 0) return 0;
  const bool beyond = lies_beyond(t, facing, p);
  if (beyond != ray_towards_plus(p)) return 0;
  return beyond ? facing : -facing;
}

/// The float interval that contains a double.
struct FloatInterval {
  float lower, upper;

  IST_HD explicit FloatInterval(double value)
      : lower(rounded_down(value)), upper(rounded_up(value)) {}
};

/// A box that contains the ray from p, or a whole line; rounded outward.
struct RayBox {
  float lower[3], upper[3];

  /// The ray of ray_winding().
  IST_HD static RayBox ray(const double p[3]) {
    const FloatInterval x(p[0]);
    RayBox box = line(p[1], p[2]);
    if (ray_towards_plus(p)) {
      box.lower[0] = x.lower;
    } else {
      box.upper[0] = x.upper;
    }
    return box;
  }

  /// The line (·, y, z).
  IST_HD static RayBox line(double y, double z) {
    const FloatInterval iy(y), iz(z);
    return {{-HUGE_VALF, iy.lower, iz.lower}, {HUGE_VALF, iy.upper, iz.upper}};
  }
};

}  // namespace ist
