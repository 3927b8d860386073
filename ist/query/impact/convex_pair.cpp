#include "query/impact/convex_pair.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "query/base/relative_pose.h"
#include "query/exact/nearest_points.h"

namespace ist {
namespace {

using Eigen::Vector3d;

void keep_nearer(NearestPoints& best, double& best2, const Vector3d& a,
                 const Vector3d& b) noexcept {
  const double d2 = (b - a).squaredNorm();
  if (!(d2 < best2)) return;
  best2 = d2;
  best.a = a;
  best.b = b;
}

/// The nearest points of segments p p' and q q' (Ericson, Real-Time Collision Detection, 5.1.9).
void nearest_of_edges(const Vector3d& p, const Vector3d& p1, const Vector3d& q, const Vector3d& q1,
                      NearestPoints& best, double& best2) noexcept {
  const Vector3d u = p1 - p, v = q1 - q, w = p - q;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
  const double uw = u.dot(w), vw = v.dot(w);
  if (!(uu > 0) || !(vv > 0)) return;  // nearest_in_piece() covers these
  const double cross = uu * vv - uv * uv;
  double s = cross > 0 ? std::clamp((uv * vw - uw * vv) / cross, 0.0, 1.0) : 0.0;
  double t = (uv * s + vw) / vv;
  if (t < 0 || t > 1) {
    t = std::clamp(t, 0.0, 1.0);
    s = std::clamp((uv * t - uw) / uu, 0.0, 1.0);
  }
  keep_nearer(best, best2, p + s * u, q + t * v);
}

bool edge_crosses(const Vector3d& p, const Vector3d& q, const ConvexPiece& t) noexcept {
  const Vector3d a = t.corner[0] - p, b = t.corner[1] - p, c = t.corner[2] - p, d = q - p;
  const Vector3d n = (b - a).cross(c - a);
  if ((n.dot(a) > 0) == (n.dot(a - d) > 0)) return false;
  const double x = d.dot(a.cross(b)), y = d.dot(b.cross(c)), z = d.dot(c.cross(a));
  return (x >= 0 && y >= 0 && z >= 0) || (x <= 0 && y <= 0 && z <= 0);
}

}  // namespace

Vector3d nearest_in_piece(const ConvexPiece& piece, const Vector3d& x) noexcept {
  if (piece.corners == 1) return piece.corner[0];
  const auto point = [](const Vector3d& v) { return exact::Point{v.x(), v.y(), v.z()}; };
  const Vector3d* const c = piece.corner;
  return vector(exact::nearest_on_triangle(
      point(x), exact::FlatTriangle(point(c[0]), point(c[1]), point(c[2]))));
}

NearestPoints nearest_points(const ConvexPiece& a, const ConvexPiece& b) noexcept {
  NearestPoints best;
  double best2 = std::numeric_limits<double>::infinity();
  for (int k = 0; k < a.corners; ++k)
    keep_nearer(best, best2, a.corner[k], nearest_in_piece(b, a.corner[k]));
  for (int k = 0; k < b.corners; ++k)
    keep_nearer(best, best2, nearest_in_piece(a, b.corner[k]), b.corner[k]);
  if (a.corners == 3 && b.corners == 3) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        nearest_of_edges(a.corner[i], a.corner[(i + 1) % 3], b.corner[j], b.corner[(j + 1) % 3],
                         best, best2);
  }
  best.distance = std::sqrt(best2);
  return best;
}

bool triangles_cross(const ConvexPiece& a, const ConvexPiece& b) noexcept {
  for (int k = 0; k < 3; ++k) {
    if (edge_crosses(a.corner[k], a.corner[(k + 1) % 3], b) ||
        edge_crosses(b.corner[k], b.corner[(k + 1) % 3], a))
      return true;
  }
  return false;
}

double apart_along(const Vector3d& n, const ConvexPiece& a, const ConvexPiece& b) noexcept {
  double last_a = -std::numeric_limits<double>::infinity();
  double first_b = std::numeric_limits<double>::infinity();
  for (int k = 0; k < a.corners; ++k) last_a = std::max(last_a, n.dot(a.corner[k]));
  for (int k = 0; k < b.corners; ++k) first_b = std::min(first_b, n.dot(b.corner[k]));
  return first_b - last_a;
}

}  // namespace ist
