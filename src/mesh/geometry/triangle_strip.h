#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace ist {

/// The strip of a plane along a triangle's edge from its lowest to its highest corner that contains
/// the triangle: narrow even if its box is wide, for needles.
struct TriangleStrip {
  double at0, slope;   ///< the edge's x at y = 0, and dx/dy
  double left, right;  ///< the strip's sides along x, from the edge

  /// The corners must not all have the same y.
  TriangleStrip(const std::array<double, 3>& x, const std::array<double, 3>& y) {
    const auto [first, last] = std::minmax_element(y.begin(), y.end());
    const auto low = static_cast<std::size_t>(first - y.begin()),
               high = static_cast<std::size_t>(last - y.begin()), middle = 3 - low - high;
    slope = (x[high] - x[low]) / (y[high] - y[low]);
    at0 = x[low] - slope * y[low];
    const double off = x[middle] - at(y[middle]);
    left = std::min(off, 0.0);
    right = std::max(off, 0.0);
  }

  double at(double y) const { return at0 + slope * y; }
};

}  // namespace ist
