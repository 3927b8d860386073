#pragma once

#include <cmath>

#include "mesh/exact_triangle.h"
#include "mesh/wide_tree.h"

// The steps of building a WideTree that concern one triangle, for host and device.

namespace ist {

/// A box in float that holds what is in it, rounding included. Empty by default.
struct WideBox {
  float lower[3] = {HUGE_VALF, HUGE_VALF, HUGE_VALF};
  float upper[3] = {-HUGE_VALF, -HUGE_VALF, -HUGE_VALF};

  /// Takes a point in; the box then holds its exact and its rounded coordinates.
  IST_HD void extend(const double point[3]) {
    for (int k = 0; k < 3; ++k) {
      const auto f = static_cast<float>(point[k]);
      const float below = static_cast<double>(f) > point[k] ? nextafterf(f, -HUGE_VALF) : f;
      const float above = static_cast<double>(f) < point[k] ? nextafterf(f, HUGE_VALF) : f;
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

constexpr int kCurveBits = 16;  ///< of each coordinate

/// Place of a point of the unit frame's cube along Hilbert's curve, 3 · kCurveBits bits. What is
/// near on the curve is near in space, and no step of it is long, so blocks of successive triangles
/// have small boxes. (J. Skilling, "Programming the Hilbert curve", 2004.)
IST_HD inline std::uint64_t curve_place(const float point[3]) {
  constexpr float kCells = 1 << kCurveBits;
  std::uint32_t x[3];
  for (int k = 0; k < 3; ++k) {
    const float cell = (point[k] + 1) * (kCells / 2);
    x[k] = static_cast<std::uint32_t>(cell > 0 ? (cell < kCells - 1 ? cell : kCells - 1) : 0);
  }
  for (std::uint32_t bit = 1u << (kCurveBits - 1); bit > 1; bit >>= 1) {
    const std::uint32_t lower = bit - 1;
    for (int k = 0; k < 3; ++k) {
      if ((x[k] & bit) != 0) {
        x[0] ^= lower;
      } else {
        const std::uint32_t swapped = (x[0] ^ x[k]) & lower;
        x[0] ^= swapped;
        x[k] ^= swapped;
      }
    }
  }
  x[1] ^= x[0];
  x[2] ^= x[1];
  std::uint32_t turned = 0;
  for (std::uint32_t bit = 1u << (kCurveBits - 1); bit > 1; bit >>= 1)
    if ((x[2] & bit) != 0) turned ^= bit - 1;
  std::uint64_t place = 0;
  for (int b = kCurveBits - 1; b >= 0; --b)
    for (int k = 0; k < 3; ++k) place = place << 1 | ((x[k] ^ turned) >> b & 1u);
  return place;
}

/// Place of a triangle along the curve: that of its box's centre.
IST_HD inline std::uint64_t curve_place(const Corners& corners) {
  const WideBox box = box_of(corners);
  float centre[3];
  for (int k = 0; k < 3; ++k) centre[k] = (box.lower[k] + box.upper[k]) / 2;
  return curve_place(centre);
}

/// Writes a lane of a block; its corners are looked up in `vertices`. kNoTriangle: an empty lane.
IST_HD inline void write_lane(WideBlock& block, int lane, const double* vertices,
                              std::uint32_t triangle, const std::uint32_t corner[3]) {
  TriangleFrame<double> f = {{1e18, 1e18, 1e18}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0, 0, 0};
  if (triangle != kNoTriangle)
    f = make_triangle_frame(vertices + 3 * std::size_t{corner[0]},
                            vertices + 3 * std::size_t{corner[1]},
                            vertices + 3 * std::size_t{corner[2]});
  for (int k = 0; k < 3; ++k) {
    block.origin[k][lane] = static_cast<float>(f.origin[k]);
    block.u[k][lane] = static_cast<float>(f.u[k]);
    block.v[k][lane] = static_cast<float>(f.v[k]);
    block.n[k][lane] = static_cast<float>(f.n[k]);
    block.corner[k][lane] = triangle != kNoTriangle ? corner[k] : 0;
  }
  block.length[lane] = static_cast<float>(f.length);
  block.apex[lane] = static_cast<float>(f.apex);
  block.height[lane] = static_cast<float>(f.height);
  block.triangle[lane] = triangle;
}

}  // namespace ist
