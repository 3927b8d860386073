#include "query/impact/hull_pair.h"

#include <limits>

#include "query/impact/gjk.h"

namespace ist {

using Eigen::Vector3d;

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
