#include "bake/predict/convex_body.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace ist {

using Eigen::Matrix3d;
using Eigen::Vector3d;

ConvexBody ConvexBody::ball(const Vector3d& centre, double radius) {
  ConvexBody body;
  body.centre_ = centre;
  body.half_extents_ = Vector3d::Constant(radius);
  body.round_ = true;
  return body;
}

ConvexBody ConvexBody::box(const Vector3d& centre, const Matrix3d& axes,
                           const Vector3d& half_extents) {
  ConvexBody body;
  body.centre_ = centre;
  body.axes_ = axes;
  body.half_extents_ = half_extents;
  return body;
}

std::optional<LinePart> ConvexBody::part_of(const Vector3d& origin,
                                            const Vector3d& direction) const {
  const Vector3d from_centre = origin - centre_;
  if (round_) {
    const double length2 = direction.squaredNorm(), along = from_centre.dot(direction);
    const double radius = half_extents_.x();
    const double inside = along * along - length2 * (from_centre.squaredNorm() - radius * radius);
    if (!(inside > 0)) return std::nullopt;
    const double half = std::sqrt(inside);
    return LinePart{(-along - half) / length2, (-along + half) / length2};
  }
  LinePart part = {-std::numeric_limits<double>::max(), std::numeric_limits<double>::max()};
  for (int k = 0; k < 3; ++k) {
    const double at = axes_.col(k).dot(from_centre), step = axes_.col(k).dot(direction);
    const double half = half_extents_[k];
    constexpr double kParallel = 1e-12;
    if (std::abs(step) < kParallel) {
      if (std::abs(at) >= half) return std::nullopt;
      continue;
    }
    double enters = (-half - at) / step, leaves = (half - at) / step;
    if (step < 0) std::swap(enters, leaves);
    part.from = std::max(part.from, enters);
    part.to = std::min(part.to, leaves);
  }
  if (!(part.from < part.to)) return std::nullopt;
  return part;
}

double ConvexBody::volume() const {
  const double box = 8 * half_extents_.prod();
  return round_ ? std::numbers::pi / 6 * box : box;
}

ConvexBody ConvexBody::moved(const Vector3d& by) const {
  ConvexBody body = *this;
  body.centre_ += by;
  return body;
}

}  // namespace ist
