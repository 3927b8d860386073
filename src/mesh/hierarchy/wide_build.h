#pragma once

#include <cmath>

#include "base/elementary.h"
#include "mesh/geometry/exact_triangle.h"
#include "mesh/hierarchy/wide_tree.h"

// Steps of building a WideTree that concern one triangle, for host and device.

namespace ist {

/// A box in float that contains its content, rounding included. Empty by default.
struct WideBox {
  float lower[3] = {HUGE_VALF, HUGE_VALF, HUGE_VALF};
  float upper[3] = {-HUGE_VALF, -HUGE_VALF, -HUGE_VALF};

  /// Adds a point: the box then contains its exact and its rounded coordinates.
  IST_HD void extend(const double point[3]) {
    for (int k = 0; k < 3; ++k) {
      const float below = rounded_down(point[k]), above = rounded_up(point[k]);
      lower[k] = below < lower[k] ? below : lower[k];
      upper[k] = above > upper[k] ? above : upper[k];
    }
  }

  IST_HD void write_to(WideNode& node, int child) const {
    for (int k = 0; k < 3; ++k) {
      node.lower[k][child] = lower[k];
      node.upper[k][child] = upper[k];
    }
  }
};

IST_HD inline WideBox box_of(const Corners& corners) {
  WideBox box;
  for (const double* corner : corners.p) box.extend(corner);
  return box;
}

/// Sums over a block's triangles that determine its oriented box. The order of summation affects
/// only how tight the box is.
struct WideMoments {
  float normal[3] = {};  ///< areas times normals, twice
  float sum[3] = {};     ///< of corners, seen from `origin`
  float square[6] = {};  ///< of corners: xx yy zz xy yz zx
  float count = 0;

  IST_HD void add(const Corners& corners, const double origin[3]) {
    float e[3][3];
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) e[i][k] = static_cast<float>(corners.p[i][k] - origin[k]);
      for (int k = 0; k < 3; ++k) {
        sum[k] += e[i][k];
        square[k] += e[i][k] * e[i][k];
        square[3 + k] += e[i][k] * e[i][(k + 1) % 3];
      }
      count += 1;
    }
    float area[3];
    area_normal(e[0], e[1], e[2], area);
    for (int k = 0; k < 3; ++k) normal[k] += area[k];
  }

  /// Calls visit(number) for every sum.
  template <class Visit>
  IST_HD void for_each(Visit&& visit) {
    for (int k = 0; k < 3; ++k) visit(normal[k]);
    for (int k = 0; k < 3; ++k) visit(sum[k]);
    for (int k = 0; k < 6; ++k) visit(square[k]);
    visit(count);
  }
};

/// An oriented box, see WideOriented. Empty by default.
struct WideOrientedBox {
  float n[3] = {1, 0, 0}, u[3] = {0, 1, 0};
  float lower[3] = {HUGE_VALF, HUGE_VALF, HUGE_VALF};
  float upper[3] = {-HUGE_VALF, -HUGE_VALF, -HUGE_VALF};

  IST_HD WideOrientedBox() {}

  /// n is the mean normal, u the direction in which the corners spread most across it.
  IST_HD explicit WideOrientedBox(const WideMoments& of) {
    const auto scale_to_one = [](double x[3]) {
      const double length = std::sqrt(dot3(x, x));
      for (int k = 0; k < 3; ++k) x[k] = length > 0 ? x[k] / length : 0;
      return length > 0;
    };
    double normal[3] = {of.normal[0], of.normal[1], of.normal[2]};
    if (!scale_to_one(normal)) normal[0] = 1;
    // Any two directions perpendicular to it.
    double a[3] = {0, -normal[2], normal[1]}, b[3];
    if (normal[0] * normal[0] > 0.5) {
      a[0] = normal[1];
      a[1] = -normal[0];
      a[2] = 0;
    }
    scale_to_one(a);
    cross3(normal, a, b);
    const double count = of.count > 0 ? of.count : 1;
    // The covariance of the corners in these directions, and its larger axis.
    const auto spread = [&](const double x[3], const double y[3]) {
      double sum = 0;
      for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        const double ii = of.square[i] - double(of.sum[i]) * of.sum[i] / count;
        const double ij = of.square[3 + i] - double(of.sum[i]) * of.sum[j] / count;
        sum += ii * (x[i] * y[i]) + ij * (x[i] * y[j] + x[j] * y[i]);
      }
      return sum;
    };
    const double aa = spread(a, a), bb = spread(b, b), ab = spread(a, b);
    const double half = (aa - bb) / 2, root = std::sqrt(half * half + ab * ab);
    double along[3] = {half < 0 ? ab : half + root, half < 0 ? root - half : ab, 0};
    if (!scale_to_one(along)) along[0] = 1;
    for (int k = 0; k < 3; ++k) {
      n[k] = static_cast<float>(normal[k]);
      u[k] = static_cast<float>(along[0] * a[k] + along[1] * b[k]);
    }
  }

  IST_HD void extend(const double point[3]) {
    float v[3];
    cross3(n, u, v);
    for (int k = 0; k < 3; ++k) {
      const float* axis = k == 0 ? n : k == 1 ? u : v;
      const double at = axis[0] * point[0] + axis[1] * point[1] + axis[2] * point[2];
      const auto f = static_cast<float>(at);
      const float below = nextafterf(f, -HUGE_VALF), above = nextafterf(f, HUGE_VALF);
      lower[k] = below < lower[k] ? below : lower[k];
      upper[k] = above > upper[k] ? above : upper[k];
    }
  }

  template <int kWidth>
  IST_HD void write_to(OrientedBoxes<kWidth>& boxes, int child) const {
    for (int k = 0; k < 3; ++k) {
      const bool empty = !(lower[k] <= upper[k]);
      const float middle = empty ? 0 : (lower[k] + upper[k]) / 2;
      const float to_lower = middle - lower[k], to_upper = upper[k] - middle;
      boxes.n[k][child] = n[k];
      boxes.u[k][child] = u[k];
      boxes.middle[k][child] = middle;
      boxes.half[k][child] =
          empty ? -HUGE_VALF : nextafterf(to_lower > to_upper ? to_lower : to_upper, HUGE_VALF);
    }
  }
};

/// Writes a lane of a block, with corners from `vertices`. kNoTriangle: an empty lane.
IST_HD inline void write_lane(WideBlock& block, int lane, const double* vertices,
                              std::uint32_t triangle, const std::uint32_t corner[3]) {
  TriangleFrame<double> f = absent_frame();
  if (triangle != kNoTriangle)
    f = make_triangle_frame(vertices + 3 * std::size_t{corner[0]},
                            vertices + 3 * std::size_t{corner[1]},
                            vertices + 3 * std::size_t{corner[2]});
  write_frame(block, lane, f);
  for (int k = 0; k < 3; ++k) block.corner[k][lane] = triangle != kNoTriangle ? corner[k] : 0;
  block.triangle[lane] = triangle;
}

}  // namespace ist
