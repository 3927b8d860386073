#pragma once

#include <cmath>

#include "base/host_device.h"
#include "base/vec3.h"

namespace ist::gpu {

constexpr int kSeen = 32;  ///< triangles tested together, a bit each

/// The error of lengths, relative to the reach within which triangles are staged.
constexpr float kSeenTolerance = 1e-5f;

/// A point relative to a triangle: its heights above the plane and, in that plane, above the edges,
/// positive inside.
struct SeenFrom {
  float height, edge[3];
};

/// Triangles staged around a point: in float, with lengths as fractions of a reach.
struct SeenTriangles {
  struct alignas(16) Plane {
    float n[3], at_centre;
  };
  double centre[3], per;  ///< 1 / reach
  Plane plane[kSeen][4];  ///< the triangle's plane, and those through its edges

  /// Sets the point and reach before any triangle is staged.
  IST_HD void look_from(const double (&x)[3], double reach) {
    for (int k = 0; k < 3; ++k) centre[k] = x[k];
    per = 1 / reach;
  }

  IST_HD void see(int place, const double (&c)[3][3]) {
    double corner[3][3], edge[3][3], length2[3], far2 = 1, diagonal[3], n[3];
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        corner[i][k] = (c[i][k] - centre[k]) * per;
        edge[i][k] = c[i == 2 ? 0 : i + 1][k] - c[i][k];
      }
      length2[i] = dot(edge[i], edge[i]);
      far2 = most(far2, dot(corner[i], corner[i]));
    }
    for (int k = 0; k < 3; ++k) diagonal[k] = c[2][k] - c[0][k];
    cross(edge[0], diagonal, n);  // as in TrianglePlane
    const double n2 = dot(n, n);
    // Nothing is certain about a triangle that is too small, or so thin that rounding turns its
    // plane by more than the tolerance.
    constexpr double kTurn = 0x1p-50, kUnseen = kSeenTolerance / 4;
    const bool clear = n2 * (kUnseen * kUnseen) >
                           (kTurn * kTurn) * (length2[0] * dot(diagonal, diagonal)) * far2 &&
                       n2 > kSmallest &&
                       least(least(length2[0], length2[1]), length2[2]) > kSmallest;
    const double per_n = clear ? inverse_root(n2) : 0;
    for (double& x : n) x *= per_n;
    plane[place][0] = plane_through(corner[0], n);
    if (!(n2 > 0)) plane[place][0].at_centre = kFar;  // it is flat: no ball meets it
    for (int i = 0; i < 3; ++i) {
      double inwards[3];
      cross(n, edge[i], inwards);
      const double per_length = clear ? inverse_root(length2[i]) : 0;
      for (double& x : inwards) x *= per_length;
      plane[place][i + 1] = plane_through(corner[i], inwards);
    }
  }

  /// Converts a point or a length to staged units.
  IST_HD void seen(const double (&x)[3], float (&p)[3]) const {
    for (int k = 0; k < 3; ++k) p[k] = static_cast<float>((x[k] - centre[k]) * per);
  }
  IST_HD float seen_radius(double r) const {
    return static_cast<float>(r * per) * (1 + kSeenTolerance) + kSeenTolerance;
  }

  IST_HD SeenFrom from(int triangle, const float (&p)[3]) const {
    const Plane(&planes)[4] = plane[triangle];
    return {over(planes[0], p), {over(planes[1], p), over(planes[2], p), over(planes[3], p)}};
  }
  IST_HD SeenFrom from_centre(int triangle) const {
    const Plane(&planes)[4] = plane[triangle];
    return {planes[0].at_centre, {planes[1].at_centre, planes[2].at_centre, planes[3].at_centre}};
  }

  /// True if a triangle may intersect a ball of that radius.
  IST_HD static bool meets(const SeenFrom& at, float r) {
    return at.height < r && -at.height < r && at.edge[0] > -r && at.edge[1] > -r && at.edge[2] > -r;
  }

 private:
  static constexpr float kFar = 1e30f;
  static constexpr double kSmallest = 1e-36;  ///< a float still has all its digits
  IST_HD static float over(const Plane& plane, const float (&p)[3]) {
    return std::fma(plane.n[0], p[0],
                    std::fma(plane.n[1], p[1], std::fma(plane.n[2], p[2], plane.at_centre)));
  }
  IST_HD static Plane plane_through(const double (&x)[3], const double (&n)[3]) {
    return {{static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])},
            static_cast<float>(-dot(n, x))};
  }
  /// The inverse root to a float's digits. It scales all numbers of a plane alike.
  IST_HD static double inverse_root(double square) {
    return static_cast<double>(1.0f / std::sqrt(static_cast<float>(square)));
  }
};

}  // namespace ist::gpu
