#include "mesh/winding.h"

#include <algorithm>
#include <cmath>

#include "mesh/closest_point.h"
#include "mesh/exact_sign.h"

namespace ist {
namespace {

struct Corners {
  const double* p[3];
};

Corners corners(const MeshView& mesh, std::uint32_t triangle) {
  const std::uint32_t* t = mesh.triangles + 3 * std::size_t{triangle};
  const auto at = [&](int i) { return mesh.vertices_exact + 3 * std::size_t{t[i]}; };
  return {{at(0), at(1), at(2)}};
}

/// Crossing of the edge p → q with the half-line {y > y0, z = z0} of the (y, z) plane: +1 upward,
/// −1 downward, 0 none. A corner at z0 counts as below and an edge through (y0, z0) as not
/// crossing. The edge is looked at from its lower end, whichever triangle asks.
int edge_crossing(const double* p, const double* q, const double yz[2]) {
  const bool upward = !(p[2] > yz[1]);
  if (upward == !(q[2] > yz[1])) return 0;
  const double* low = upward ? p : q;
  const double* high = upward ? q : p;
  if (std::max(p[1], q[1]) <= yz[0]) return 0;
  if (std::min(p[1], q[1]) <= yz[0] && orient2d_sign(low + 1, high + 1, yz) <= 0) return 0;
  return upward ? 1 : -1;
}

/// Winding number of a triangle's outline, seen along x, about (y0, z0): the sign of its normal's x
/// where the line pierces it, else 0.
int pierced(const Corners& t, const double yz[2]) {
  return edge_crossing(t.p[0], t.p[1], yz) + edge_crossing(t.p[1], t.p[2], yz) +
         edge_crossing(t.p[2], t.p[0], yz);
}

/// Where the line (·, y0, z0) meets a triangle that it pierces: the corners weighted with the
/// areas opposite them. Never outside the triangle's extent in x.
double crossing_x(const Corners& t, const double yz[2]) {
  double weight_sum = 0, sum = 0;
  for (int i = 0; i < 3; ++i) {
    const double* p = t.p[(i + 1) % 3];
    const double* q = t.p[(i + 2) % 3];
    const double weight =
        std::abs((p[1] - yz[0]) * (q[2] - yz[1]) - (p[2] - yz[1]) * (q[1] - yz[0]));
    weight_sum += weight;
    sum += weight * t.p[i][0];
  }
  const auto [low, high] = std::minmax({t.p[0][0], t.p[1][0], t.p[2][0]});
  return weight_sum > 0 ? std::clamp(sum / weight_sum, low, high) : low / 2 + high / 2;
}

/// The float interval that holds a double.
struct Interval {
  explicit Interval(double value) {
    const auto f = static_cast<float>(value);
    lower = static_cast<double>(f) > value ? std::nextafterf(f, -HUGE_VALF) : f;
    upper = static_cast<double>(f) < value ? std::nextafterf(f, HUGE_VALF) : f;
  }
  float lower, upper;
};

/// Calls visit(triangle) for all triangles whose boxes meet the box x × y × z.
template <class Visit>
void for_triangles_in(const MeshView& mesh, const Interval box[3], Visit&& visit) {
  if (mesh.root == kBvhEmpty) return;
  std::uint32_t stack[kBvhStackSize];
  int top = 0;
  stack[top++] = mesh.root;
  while (top > 0) {
    const std::uint32_t at = stack[--top];
    if ((at & kBvhLeaf) != 0) {
      for (const std::uint32_t triangle : mesh.blocks[at & ~kBvhLeaf].triangle)
        if (triangle != kNoTriangle) visit(triangle);
      continue;
    }
    const BvhNode& node = mesh.nodes[at];
    int hit[kBvhWidth] = {1, 1, 1, 1};
    for (int k = 0; k < 3; ++k) {
      for (int i = 0; i < kBvhWidth; ++i)
        hit[i] &= (node.lower[k][i] <= box[k].upper) & (node.upper[k][i] >= box[k].lower);
    }
    for (int i = 0; i < kBvhWidth; ++i)
      if (hit[i] != 0) stack[top++] = node.child[i];
  }
}

}  // namespace

int winding_number(const MeshView& mesh, const double p[3]) {
  // Towards the nearer end: the signs on the other half of the line are the same, negated.
  const bool towards_plus = p[0] >= 0;
  Interval box[3] = {Interval(p[0]), Interval(p[1]), Interval(p[2])};
  (towards_plus ? box[0].upper : box[0].lower) = towards_plus ? HUGE_VALF : -HUGE_VALF;
  int winding = 0;
  for_triangles_in(mesh, box, [&](std::uint32_t triangle) {
    const Corners t = corners(mesh, triangle);
    const int facing = pierced(t, p + 1);
    if (facing == 0) return;
    const auto [low, high] = std::minmax({t.p[0][0], t.p[1][0], t.p[2][0]});
    // Behind an outward triangle that faces +x the surface lies further along +x.
    bool beyond = p[0] < low;
    if (low <= p[0] && p[0] <= high) beyond = orient3d_sign(t.p[0], t.p[1], t.p[2], p) * facing > 0;
    if (beyond == towards_plus) winding += towards_plus ? facing : -facing;
  });
  return winding;
}

void line_crossings(const MeshView& mesh, double y, double z, std::vector<Crossing>& out) {
  out.clear();
  const double yz[2] = {y, z};
  Interval box[3] = {Interval(0), Interval(y), Interval(z)};
  box[0].lower = -HUGE_VALF;
  box[0].upper = HUGE_VALF;
  for_triangles_in(mesh, box, [&](std::uint32_t triangle) {
    const Corners t = corners(mesh, triangle);
    const int facing = pierced(t, yz);
    if (facing != 0) out.push_back({crossing_x(t, yz), -facing});
  });
  std::sort(out.begin(), out.end(), [](const Crossing& a, const Crossing& b) {
    return a.x != b.x ? a.x < b.x : a.sign > b.sign;
  });
}

}  // namespace ist
