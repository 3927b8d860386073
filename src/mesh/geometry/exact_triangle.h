#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "base/host_device.h"
#include "mesh/geometry/closest_point.h"
#include "mesh/geometry/triangle_frame.h"

namespace ist {

/// The exact corners of a triangle, unit frame.
struct Corners {
  const double* p[3];
};

IST_HD inline Corners corners_of(const MeshView& mesh, std::uint32_t triangle) {
  const std::uint32_t* t = mesh.triangles + 3 * std::size_t{triangle};
  const auto at = [&](int i) { return mesh.vertices + 3 * std::size_t{t[i]}; };
  return {{at(0), at(1), at(2)}};
}

IST_HD inline TriangleFrame<double> frame_of(const Corners& t) {
  return make_triangle_frame(t.p[0], t.p[1], t.p[2]);
}

/// Closest point of a triangle by the double formula; returns the squared distance.
IST_HD inline double exact_closest_in(const Corners& corners, const double p[3], double point[3]) {
  const TriangleFrame<double> frame = frame_of(corners);
  const FramePoint<double> q = closest_in_frame(frame, p);
  for (int k = 0; k < 3; ++k) point[k] = frame.origin[k] + (q.x * frame.u[k] + q.y * frame.v[k]);
  return q.distance2;
}

/// Excludes triangles by their float distances from a double point.
struct ExactReach {
  float p[3];   ///< the point, rounded
  float error;  ///< of a float distance from it

  IST_HD explicit ExactReach(const double exact[3]) {
    float reach = 0;
    for (int k = 0; k < 3; ++k) {
      p[k] = static_cast<float>(exact[k]);
      const auto a = static_cast<float>(exact[k] < 0 ? -exact[k] : exact[k]);
      reach = a > reach ? a : reach;
    }
    error = float_distance_error(reach * (1 + 0x1p-20f));
  }

  /// A triangle may lie within `distance2` only if its float distance² is at most this.
  IST_HD float reach2(double distance2) const {
    // A float at or above distance2; large ones count as infinite.
    const float above =
        distance2 < 1e30 ? static_cast<float>(distance2) * (1 + 0x1p-20f) + 1e-37f : 1e35f;
    return prune_distance2(above, error);
  }
};

/// Meshes above this mean_slenderness() consist of needles, which axis-aligned boxes bound poorly.
constexpr double kSlender = 32;

/// The ratio of the triangles' boxes to the triangles: half the boxes' surface over the triangles'
/// area. `corners(t)`: of triangle t. About 4 for regular triangles, twice the length over the
/// width for needles. The same bits for any number of threads.
template <class CornersOf>
double mean_slenderness(std::size_t count, const CornersOf& corners) {
  using Sums = std::pair<double, double>;  // boxes, triangles
  constexpr std::size_t kGrain = 4096;
  const Sums sums = tbb::parallel_deterministic_reduce(
      tbb::blocked_range<std::size_t>(0, count, kGrain), Sums(),
      [&](const tbb::blocked_range<std::size_t>& range, Sums sum) {
        for (std::size_t t = range.begin(); t != range.end(); ++t) {
          const Corners c = corners(t);
          double size[3], normal[3];
          for (int k = 0; k < 3; ++k) {
            const auto [low, high] = std::minmax({c.p[0][k], c.p[1][k], c.p[2][k]});
            size[k] = high - low;
          }
          area_normal(c.p[0], c.p[1], c.p[2], normal);
          sum.first += size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
          sum.second += std::sqrt(dot3(normal, normal)) / 2;
        }
        return sum;
      },
      [](const Sums& a, const Sums& b) { return Sums(a.first + b.first, a.second + b.second); });
  return sums.second > 0 ? sums.first / sums.second : 0;
}

}  // namespace ist
