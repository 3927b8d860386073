#pragma once

#include "cuda/query/disc_part.h"
#include "numerics/host_device.h"

namespace ist::gpu {

constexpr int kStaged = 32;  ///< triangles looked at together

/// Triangles as balls near a point see them: in floats, lengths being parts of a reach about it.
struct SeenTriangles {
  static constexpr int kNumbers = 14;
  float plane[kNumbers][kStaged];

  /// False if the triangle does not come within the reach of the point. `c`: its corners.
  IST_HD_ONCE static bool see(const double (&c)[3][3], const double (&centre)[3], double reach,
                              float (&seen)[kNumbers]) {
    const TrianglePlane t(c);
    double height, x, y;
    t.feet(centre, height, x, y);
    if (!(size_of(height) < reach && x > t.left - reach && x < t.right + reach && y > -reach &&
          y < t.top + reach))
      return false;
    const double per = 1 / reach;
    for (int k = 0; k < 3; ++k) {
      seen[k] = static_cast<float>(t.n[k]);
      seen[3 + k] = static_cast<float>(t.u[k]);
      seen[6 + k] = static_cast<float>(t.v[k]);
    }
    seen[9] = static_cast<float>(height * per);
    seen[10] = bounded((x - t.left) * per);
    seen[11] = bounded((t.right - x) * per);
    seen[12] = bounded(y * per);
    seen[13] = bounded((t.top - y) * per);
    return true;
  }

  IST_HD void set(int place, const float (&seen)[kNumbers]) {
    for (int k = 0; k < kNumbers; ++k) plane[k][place] = seen[k];
  }

  /// Whether a triangle may meet a ball that lies within the reach.
  IST_HD bool meets(int triangle, const double (&x)[3], double radius, const double (&centre)[3],
                    double reach) const {
    constexpr float kRoom = 1e-5f;
    const double per = 1 / reach;
    const auto r = static_cast<float>(radius * per) * (1 + kRoom) + kRoom;
    float at[3];
    for (int k = 0; k < 3; ++k) at[k] = static_cast<float>((x[k] - centre[k]) * per);
    const auto along = [&](int axis) {
      return (at[0] * plane[axis][triangle] + at[1] * plane[axis + 1][triangle]) +
             at[2] * plane[axis + 2][triangle];
    };
    const float height = plane[9][triangle] + along(0), u = along(3), v = along(6);
    return height < r && -height < r && plane[10][triangle] + u > -r &&
           plane[11][triangle] - u > -r && plane[12][triangle] + v > -r &&
           plane[13][triangle] - v > -r;
  }

 private:
  IST_HD static float bounded(double x) { return static_cast<float>(x < 1e30 ? x : 1e30); }
};

}  // namespace ist::gpu
