#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "mesh/triangle_frame.h"

namespace ist {

inline constexpr double kFar = 1e3;  ///< further than anything in the unit frame

/// All points between a few corners: a convex body, or a flat one. Unit frame.
class Hull {
 public:
  using Point = std::array<double, 3>;
  static constexpr std::size_t kMost = 24;  ///< corners

  /// A plane, by heights over it and two directions in it.
  struct Plane {
    double normal[3], offset;  ///< height = normal · x − offset; of unit length
    double u[3], v[3];         ///< across each other and the normal; of any length
  };

  Hull() = default;
  explicit Hull(std::span<const Point> corners);

  std::span<const Point> corners() const { return {corner_.data(), count_}; }
  bool is_empty() const { return count_ == 0; }

  /// Cuts off what lies above a plane: this is what lies below, and the other part is returned.
  /// Together they hold the whole, but for rounding. False: it has too many corners for that, and
  /// stays as it is.
  bool cut(const Plane& plane, Hull& above);

 private:
  void add(const Point& corner) { corner_[count_++] = corner; }

  std::array<Point, kMost> corner_;
  std::size_t count_ = 0;
};

/// The distance of two points, and the point in their middle.
inline double between(const Hull::Point& a, const Hull::Point& b) {
  const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  return std::sqrt(dot3(d, d));
}
inline Hull::Point half_way(const Hull::Point& a, const Hull::Point& b) {
  return {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
}

}  // namespace ist
