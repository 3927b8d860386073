#include <algorithm>
#include <cmath>

#include "mesh/connectivity/self_intersections.h"
#include "mesh/geometry/exact_sign.h"

namespace ist {
namespace {

using Point = Eigen::Vector3d;

/// A triangle, and which of its corners the other one shares.
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

/// True if all unshared corners of the other lie strictly on one side of the plane of `of`: then
/// common points lie in the plane, hence in shared corners and sides.
bool plane_parts(const Side& of, const Side& other) {
  const Point &a = *of.corner[0], p = *of.corner[1] - a, q = *of.corner[2] - a;
  const exact_sign::BoundedCross normal(p.data(), q.data());
  bool above = false, below = false;
  for (std::size_t k = 0; k < 3; ++k) {
    if (other.shared[k]) continue;
    const Point r = *other.corner[k] - a;
    const int side = normal.side_of(r.data());
    if (side == 0) return false;
    (side > 0 ? above : below) = true;
  }
  return above != below;
}

/// True if, seen along an axis, a side of `of` strictly separates its third corner from the other's
/// corners, apart from those that are ends of the side.
bool line_parts(const Side& of, const Side& other, int x, int y) {
  // 0: too close to decide.
  const auto turn = [&](const Point& p, const Point& q, const Point& r) {
    const double left = (q[x] - p[x]) * (r[y] - p[y]), right = (q[y] - p[y]) * (r[x] - p[x]);
    const double area = left - right;
    const double bound = exact_sign::kOrient2dBound * (std::abs(left) + std::abs(right));
    return std::abs(area) > bound ? exact_sign::sign_of(area) : 0;
  };
  for (std::size_t k = 0; k < 3; ++k) {
    const Point &p = *of.corner[k], &q = *of.corner[(k + 1) % 3], &r = *of.corner[(k + 2) % 3];
    const int inward = turn(p, q, r);
    if (inward == 0) return false;  // degenerate in this view
    if (of.shared[(k + 2) % 3]) continue;
    bool parted = true;
    for (std::size_t c = 0; c < 3 && parted; ++c)
      parted = other.shared[c] || turn(p, q, *other.corner[c]) == -inward;
    if (parted) return true;
  }
  return false;
}

using CornerPoints = std::array<Point, 3>;

int side_of(const CornerPoints& t, const Point& p) {
  // The usual case in machine parts, decided without exact arithmetic.
  for (int k = 0; k < 3; ++k)
    if (t[0][k] == p[k] && t[1][k] == p[k] && t[2][k] == p[k]) return 0;
  return orient3d_sign(t[0].data(), t[1].data(), t[2].data(), p.data());
}

/// Signs of areas in a coordinate plane in which a triangle keeps its area.
class FlatView {
 public:
  explicit FlatView(const CornerPoints& t) {
    while (skip_ < 2 && turn(t[0], t[1], t[2]) == 0) ++skip_;
  }
  int turn(const Point& a, const Point& b, const Point& c) const {
    const double flat[3][2] = {{a[x()], a[y()]}, {b[x()], b[y()]}, {c[x()], c[y()]}};
    return orient2d_sign(flat[0], flat[1], flat[2]);
  }
  /// True if p, on the line through a and b, lies between them.
  bool between(const Point& p, const Point& a, const Point& b) const {
    for (const int k : {x(), y()})
      if (p[k] < std::min(a[k], b[k]) || p[k] > std::max(a[k], b[k])) return false;
    return true;
  }

 private:
  int x() const { return (skip_ + 1) % 3; }
  int y() const { return (skip_ + 2) % 3; }
  int skip_ = 0;
};

bool segments_meet_flat(const FlatView& view, const Point& p, const Point& q, const Point& a,
                        const Point& b) {
  const int pa = view.turn(p, q, a), pb = view.turn(p, q, b);
  const int ap = view.turn(a, b, p), aq = view.turn(a, b, q);
  if (pa * pb < 0 && ap * aq < 0) return true;
  return (pa == 0 && view.between(a, p, q)) || (pb == 0 && view.between(b, p, q)) ||
         (ap == 0 && view.between(p, a, b)) || (aq == 0 && view.between(q, a, b));
}

bool all_on_one_side(int a, int b, int c) {
  return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
}

/// True if a closed segment meets a closed triangle.
bool segment_meets_triangle(const Point& p, const Point& q, const CornerPoints& t) {
  const int side_p = side_of(t, p), side_q = side_of(t, q);
  if (side_p * side_q > 0) return false;
  if (side_p != 0 ||
      side_q != 0) {  // the line pierces the plane in one point: within the triangle?
    const auto around = [&](const Point& a, const Point& b) {
      return orient3d_sign(p.data(), q.data(), a.data(), b.data());
    };
    return all_on_one_side(around(t[0], t[1]), around(t[1], t[2]), around(t[2], t[0]));
  }
  const FlatView view(t);
  if (all_on_one_side(view.turn(t[0], t[1], p), view.turn(t[1], t[2], p), view.turn(t[2], t[0], p)))
    return true;
  for (std::size_t k = 0; k < 3; ++k)
    if (segments_meet_flat(view, p, q, t[k], t[(k + 1) % 3])) return true;
  return false;
}

/// The triangle rotated so that corner k comes first.
Triangle rotated(const Triangle& t, std::size_t k) {
  return {t[k], t[(k + 1) % 3], t[(k + 2) % 3]};
}

CornerPoints corners_of(const std::vector<Point>& vertices, const Triangle& t) {
  return {vertices[t[0]], vertices[t[1]], vertices[t[2]]};
}

bool disjoint_pair_meets(const CornerPoints& a, const CornerPoints& b) {
  const auto apart = [](const CornerPoints& t, const CornerPoints& of) {
    const int first = side_of(t, of[0]);
    return first != 0 && side_of(t, of[1]) == first && side_of(t, of[2]) == first;
  };
  if (apart(a, b) || apart(b, a)) return false;
  for (std::size_t k = 0; k < 3; ++k)
    if (segment_meets_triangle(a[k], a[(k + 1) % 3], b) ||
        segment_meets_triangle(b[k], b[(k + 1) % 3], a))
      return true;
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

bool meet_elsewhere(const std::vector<Point>& vertices, const Triangle& a, const Triangle& b) {
  std::size_t shared = 0, lone_in_a = 0, shared_in_a = 0, lone_in_b = 0, shared_in_b = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const bool in_b = std::find(b.begin(), b.end(), a[i]) != b.end();
    const bool in_a = std::find(a.begin(), a.end(), b[i]) != a.end();
    shared += in_b ? 1 : 0;
    (in_b ? shared_in_a : lone_in_a) = i;
    (in_a ? shared_in_b : lone_in_b) = i;
  }
  if (shared == 3) return true;
  const CornerPoints corners_a = corners_of(vertices, a), corners_b = corners_of(vertices, b);
  if (shared == 2) {  // possibly folded onto each other
    if (side_of(corners_a, corners_b[lone_in_b]) != 0) return false;
    const FlatView view(corners_a);
    const CornerPoints hinge = corners_of(vertices, rotated(a, lone_in_a));
    return view.turn(hinge[1], hinge[2], hinge[0]) ==
           view.turn(hinge[1], hinge[2], corners_b[lone_in_b]);
  }
  if (shared == 1) {  // common points beyond the corner extend to a side opposite to it
    const CornerPoints from_a = corners_of(vertices, rotated(a, shared_in_a));
    const CornerPoints from_b = corners_of(vertices, rotated(b, shared_in_b));
    return segment_meets_triangle(from_a[1], from_a[2], corners_b) ||
           segment_meets_triangle(from_b[1], from_b[2], corners_a);
  }
  return disjoint_pair_meets(corners_a, corners_b);
}

}  // namespace ist
