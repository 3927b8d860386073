#include "query/impact/gjk.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "query/impact/convex_pair.h"

namespace ist {
namespace {

using Eigen::Vector3d;

/// Barycentric coordinates of a triangle's point nearest to the origin.
Vector3d nearest_parts(const Vector3d& a, const Vector3d& b, const Vector3d& c) noexcept {
  const Vector3d p = nearest_in_piece({{a, b, c}, 3, 0, 0}, Vector3d::Zero());
  const Vector3d u = b - a, v = c - a, w = p - a;
  const double uu = u.squaredNorm(), uv = u.dot(v), vv = v.squaredNorm();
  const double area = uu * vv - uv * uv;
  if (area > 1e-24 * uu * vv) {
    const double s = std::clamp((vv * u.dot(w) - uv * v.dot(w)) / area, 0.0, 1.0);
    const double t = std::clamp((uu * v.dot(w) - uv * u.dot(w)) / area, 0.0, 1.0 - s);
    return {1 - s - t, s, t};
  }
  // Degenerate: along the longer side.
  const double s = uu > 0 && uu >= vv ? std::clamp(u.dot(w) / uu, 0.0, 1.0) : 0.0;
  const double t = vv > uu ? std::clamp(v.dot(w) / vv, 0.0, 1.0) : 0.0;
  return {1 - s - t, s, t};
}

double nearest_part(const Vector3d& a, const Vector3d& b) noexcept {
  const Vector3d u = b - a;
  const double uu = u.squaredNorm();
  return uu > 0 ? std::clamp(-u.dot(a) / uu, 0.0, 1.0) : 0.0;
}

/// True if x and the origin lie on one side of a triangle.
bool same_side(const Vector3d& a, const Vector3d& b, const Vector3d& c,
               const Vector3d& x) noexcept {
  const Vector3d n = (b - a).cross(c - a);
  return (n.dot(x - a) > 0) == (n.dot(a) < 0);
}

}  // namespace

bool GjkDistance::add(const Vector3d& difference, const Vector3d& of_b) noexcept {
  const double before =
      count_ > 0 ? shortest_.squaredNorm() : std::numeric_limits<double>::infinity();
  const Vector3d* const x = difference_;
  difference_[count_] = difference;
  of_b_[count_++] = of_b;
  double part[4] = {1, 0, 0, 0};
  if (count_ == 2) {
    part[1] = nearest_part(x[0], x[1]);
    part[0] = 1 - part[1];
  } else if (count_ >= 3) {
    double least = std::numeric_limits<double>::infinity();
    bool around = count_ == 4;
    for (int left_out = count_ == 4 ? 0 : 3; left_out < 4; ++left_out) {
      const int i = left_out == 0 ? 1 : 0, j = left_out <= 1 ? 2 : 1, k = left_out <= 2 ? 3 : 2;
      const Vector3d parts = nearest_parts(x[i], x[j], x[k]);
      const double d2 = (parts[0] * x[i] + parts[1] * x[j] + parts[2] * x[k]).squaredNorm();
      around = around && same_side(x[i], x[j], x[k], x[left_out]);
      if (!(d2 < least)) continue;
      least = d2;
      part[i] = parts[0], part[j] = parts[1], part[k] = parts[2];
      part[left_out] = 0;
    }
    if (around) {
      shortest_.setZero();
      return true;
    }
  }
  int kept = 0;
  shortest_.setZero();
  point_.setZero();
  for (int i = 0; i < count_; ++i) {
    if (!(part[i] > 0)) continue;
    shortest_ += part[i] * x[i];
    point_ += part[i] * of_b_[i];
    difference_[kept] = x[i];
    of_b_[kept++] = of_b_[i];
  }
  count_ = kept;
  return shortest_.squaredNorm() < (1 - 1e-12) * before;
}

Vector3d furthest(const PointHull& hull, const Vector3d& n) noexcept {
  double most = -std::numeric_limits<double>::infinity();
  std::uint32_t at = 0;
  for (std::uint32_t k = 0; k < hull.count; ++k) {
    const double along = n.x() * hull.x[k] + n.y() * hull.y[k] + n.z() * hull.z[k];
    if (!(along > most)) continue;
    most = along;
    at = k;
  }
  return {hull.x[at], hull.y[at], hull.z[at]};
}

HullPlane plane_between(const PointHull& a, const PointHull& b, const Vector3d& guess,
                        double least) noexcept {
  constexpr double kMostOfIt = 0.8;
  constexpr int kSteps = 16;
  HullPlane best;
  best.apart = -std::numeric_limits<double>::infinity();
  GjkDistance between;
  Vector3d across = guess;
  for (int i = 0; i < kSteps; ++i) {
    const double length = across.norm();
    if (!(length > least)) break;
    const Vector3d n = across / length;
    const Vector3d difference = furthest(b, -n) - furthest(a, n);
    const double apart = n.dot(difference);
    if (apart > best.apart) best = {n, apart};
    if (i > 0 && best.apart >= kMostOfIt * length) break;
    if (!between.add(difference, Vector3d::Zero()) && i > 0) break;
    across = between.shortest();
  }
  return best;
}

}  // namespace ist
