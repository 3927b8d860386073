#include "query/impact/impact_side.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "query/base/relative_pose.h"
#include "query/exact/nearest_points.h"

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

/// True if x and the origin lie on one side of a triangle, x further from it than `noise` over the
/// triangle's area.
bool same_side(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& x,
               double noise) noexcept {
  const Vector3d n = (b - a).cross(c - a);
  const double height = n.dot(x - a);
  return std::fabs(height) > noise && (height > 0) == (n.dot(a) < 0);
}

/// Bounds the error of a tetrahedron's volume from rounded corners. The four points at which faces
/// or circles support a direction lie in one plane but for it.
double volume_noise(const Vector3d (&x)[4]) noexcept {
  double far2 = 0, edge2 = 0;
  for (int i = 0; i < 4; ++i) {
    far2 = std::max(far2, x[i].squaredNorm());
    for (int j = 0; j < i; ++j) edge2 = std::max(edge2, (x[i] - x[j]).squaredNorm());
  }
  return 1e-13 * std::sqrt(far2) * edge2;
}

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
    const double noise = around ? volume_noise(difference_) : 0;
    for (int left_out = count_ == 4 ? 0 : 3; left_out < 4; ++left_out) {
      const int i = left_out == 0 ? 1 : 0, j = left_out <= 1 ? 2 : 1, k = left_out <= 2 ? 3 : 2;
      const Vector3d parts = nearest_parts(x[i], x[j], x[k]);
      const double d2 = (parts[0] * x[i] + parts[1] * x[j] + parts[2] * x[k]).squaredNorm();
      around = around && same_side(x[i], x[j], x[k], x[left_out], noise);
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
