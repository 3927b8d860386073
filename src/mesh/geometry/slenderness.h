#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>
#include <algorithm>
#include <cmath>
#include <utility>

#include "mesh/geometry/exact_triangle.h"

namespace ist {

/// Meshes above this mean_slenderness() are of needles, whose boxes along the axes tell little.
constexpr double kSlender = 32;

/// How much larger triangles' boxes are than the triangles: half their surface over the area.
/// `corners(t)`: of triangle t. About 4 for even triangles, twice the length over the width for
/// needles. The same bits for any number of threads.
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
