#pragma once

#include "cuda/query/disc_part.h"
#include "numerics/host_device.h"

namespace ist::gpu {

constexpr int kStaged = 32;  ///< triangles looked at together

/// A ball as triangles near a point are seen: in floats, lengths being parts of a reach about it.
struct SeenBall {
  float at[3], r;
};

/// Triangles as balls near a point see them, likewise.
struct SeenTriangles {
  static constexpr int kNumbers = 14;
  float plane[kNumbers][kStaged];

  /// False if the triangle does not come within the reach of the point; no ball meets it then.
  /// `c`: its corners.
  IST_HD bool see(int place, const double (&c)[3][3], const double (&centre)[3], double reach) {
    const TrianglePlane t(c);
    double height, x, y;
    t.feet(centre, height, x, y);
    if (!(size_of(height) < reach && x > t.left - reach && x < t.right + reach && y > -reach &&
          y < t.top + reach)) {
      for (int k = 0; k < kNumbers; ++k) plane[k][place] = 0;
      plane[9][place] = kFar;
      return false;
    }
    const double per = 1 / reach;
    for (int k = 0; k < 3; ++k) {
      plane[k][place] = static_cast<float>(t.n[k]);
      plane[3 + k][place] = static_cast<float>(t.u[k]);
      plane[6 + k][place] = static_cast<float>(t.v[k]);
    }
    plane[9][place] = static_cast<float>(height * per);
    plane[10][place] = bounded((x - t.left) * per);
    plane[11][place] = bounded((t.right - x) * per);
    plane[12][place] = bounded(y * per);
    plane[13][place] = bounded((t.top - y) * per);
    return true;
  }

  /// A ball that lies within the reach; of radius 0 none, which meets nothing.
  IST_HD static SeenBall ball(const double (&x)[3], double radius, const double (&centre)[3],
                              double reach) {
    constexpr float kRoom = 1e-5f;
    const double per = 1 / reach;
    SeenBall ball;
    for (int k = 0; k < 3; ++k) ball.at[k] = static_cast<float>((x[k] - centre[k]) * per);
    ball.r = radius > 0 ? static_cast<float>(radius * per) * (1 + kRoom) + kRoom : -kFar;
    return ball;
  }

  /// Whether a triangle may meet a ball.
  IST_HD bool meets(int triangle, const SeenBall& ball) const {
    const auto along = [&](int axis) {
      return (ball.at[0] * plane[axis][triangle] + ball.at[1] * plane[axis + 1][triangle]) +
             ball.at[2] * plane[axis + 2][triangle];
    };
    const float r = ball.r;
    const float height = plane[9][triangle] + along(0), u = along(3), v = along(6);
    return height < r && -height < r && plane[10][triangle] + u > -r &&
           plane[11][triangle] - u > -r && plane[12][triangle] + v > -r &&
           plane[13][triangle] - v > -r;
  }

 private:
  static constexpr float kFar = 1e30f;
  IST_HD static float bounded(double x) { return static_cast<float>(x < 1e30 ? x : 1e30); }
};

}  // namespace ist::gpu
