#include "mesh/triangle_separation.h"

#include <array>
#include <cmath>
#include <cstddef>

#include "mesh/exact_sign.h"

namespace ist {
namespace {

using Point = Eigen::Vector3d;

/// A triangle and which of its corners the other one shares.
struct Side {
  std::array<const Point*, 3> corner;
  std::array<bool, 3> shared;

  Side(const std::vector<Point>& vertices, const Triangle& t, const Triangle& other) {
    for (std::size_t k = 0; k < 3; ++k) {
      corner[k] = &vertices[t[k]];
      shared[k] = t[k] == other[0] || t[k] == other[1] || t[k] == other[2];
    }
  }
};

/// The other's corners that are not shared all lie strictly on one side of the plane of `of`: what
/// is in common lies in the plane, hence in shared corners and sides.
bool plane_parts(const Side& of, const Side& other) {
  const Point &a = *of.corner[0], p = *of.corner[1] - a, q = *of.corner[2] - a;
  Point normal, magnitude;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const double left = p[i] * q[j], right = p[j] * q[i];
    normal[k] = left - right;
    magnitude[k] = std::abs(left) + std::abs(right);
  }
  bool above = false, below = false;
  for (std::size_t k = 0; k < 3; ++k) {
    if (other.shared[k]) continue;
    const Point r = *other.corner[k] - a;
    const double volume = r[0] * normal[0] + r[1] * normal[1] + r[2] * normal[2];
    const double bound = exact_sign::kOrient3dBound *
                         (std::abs(r[0]) * magnitude[0] + std::abs(r[1]) * magnitude[1] +
                          std::abs(r[2]) * magnitude[2]);
    if (!(std::abs(volume) > bound)) return false;
    (volume > 0 ? above : below) = true;
  }
  return above != below;
}

/// Seen along an axis, a side of `of` has its third corner strictly on one side and on the other,
/// strictly, the other's corners but those that are ends of the side.
bool line_parts(const Side& of, const Side& other, const int x, const int y) {
  // 0: too close to tell.
  const auto turn = [&](const Point& p, const Point& q, const Point& r) {
    const double left = (q[x] - p[x]) * (r[y] - p[y]), right = (q[y] - p[y]) * (r[x] - p[x]);
    const double area = left - right;
    const double bound = exact_sign::kOrient2dBound * (std::abs(left) + std::abs(right));
    return std::abs(area) > bound ? exact_sign::sign_of(area) : 0;
  };
  for (std::size_t k = 0; k < 3; ++k) {
    const Point &p = *of.corner[k], &q = *of.corner[(k + 1) % 3], &r = *of.corner[(k + 2) % 3];
    const int inward = turn(p, q, r);
    if (inward == 0) return false;  // seen as a line
    if (of.shared[(k + 2) % 3]) continue;
    bool parted = true;
    for (std::size_t c = 0; c < 3 && parted; ++c)
      parted = other.shared[c] || turn(p, q, *other.corner[c]) == -inward;
    if (parted) return true;
  }
  return false;
}

}  // namespace

bool seen_apart(const std::vector<Point>& vertices, const Triangle& a, const Triangle& b) {
  const Side of_a(vertices, a, b), of_b(vertices, b, a);
  if (of_a.shared[0] && of_a.shared[1] && of_a.shared[2]) return false;
  if (plane_parts(of_a, of_b) || plane_parts(of_b, of_a)) return true;
  for (const int x : {0, 1, 2})
    if (line_parts(of_a, of_b, x, (x + 1) % 3) || line_parts(of_b, of_a, x, (x + 1) % 3))
      return true;
  return false;
}

}  // namespace ist
