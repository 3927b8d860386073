#include "mesh/resolve/triangle_meetings.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "mesh/resolve/unresolvable.h"

namespace ist {
namespace {

/// A point of two triangles: a vertex (low = high), or where an edge crosses a triangle's plane.
struct Named {
  std::uint32_t low, high, triangle = kNoIndex;
  auto operator<=>(const Named&) const = default;
};

class PairOfTriangles {
 public:
  PairOfTriangles(const ExactPoints& points, const std::vector<Triangle>& triangles,
                  std::vector<Named>& found)
      : points_(points), triangles_(triangles), found_(found) {}

  /// Adds the ends of what two triangles have in common; false where they lie in one plane.
  bool add_ends(const std::uint32_t a, const std::uint32_t b) {
    const Sides of_a = sides(b, a), of_b = sides(a, b);
    if (of_a == Sides{0, 0, 0}) return false;
    add_crossings(a, of_a, b);
    add_crossings(b, of_b, a);
    return true;
  }

 private:
  using Sides = std::array<int, 3>;

  /// On which sides of triangle `plane` the corners of t are.
  Sides sides(const std::uint32_t plane, const std::uint32_t t) const {
    const Triangle& of = triangles_[plane];
    Sides result;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = triangles_[t][k];
      result[k] = v == of[0] || v == of[1] || v == of[2] ? 0 : points_.side(of, points_.view(v));
    }
    return result;
  }

  /// Corners and edges of t that meet the closed triangle `other` without lying along it.
  void add_crossings(const std::uint32_t t, const Sides& side, const std::uint32_t other) {
    const Triangle &corner = triangles_[t], &of = triangles_[other];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t p = corner[k], q = corner[(k + 1) % 3];
      if (side[k] == 0 && holds(of, p)) found_.push_back({p, p});
      if (side[k] * side[(k + 1) % 3] < 0 && is_pierced(of, p, q))
        found_.push_back({std::min(p, q), std::max(p, q), other});
    }
  }

  /// Whether a closed triangle holds a vertex in its plane.
  bool holds(const Triangle& t, const std::uint32_t p) const {
    if (p == t[0] || p == t[1] || p == t[2]) return true;
    int k = 0;
    while (k < 2 && points_.turn(k, t[0], t[1], t[2]) == 0) ++k;
    return same_way(points_.turn(k, t[0], t[1], p), points_.turn(k, t[1], t[2], p),
                    points_.turn(k, t[2], t[0], p));
  }

  /// Whether the line pq, which crosses the plane of t, meets the closed triangle.
  bool is_pierced(const Triangle& t, const std::uint32_t p, const std::uint32_t q) const {
    const auto around = [&](const std::uint32_t a, const std::uint32_t b) {
      return a == p || a == q || b == p || b == q ? 0 : points_.side({p, q, a}, points_.view(b));
    };
    return same_way(around(t[0], t[1]), around(t[1], t[2]), around(t[2], t[0]));
  }

  static bool same_way(const int a, const int b, const int c) {
    return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
  }

  const ExactPoints& points_;
  const std::vector<Triangle>& triangles_;
  std::vector<Named>& found_;
};

/// Gives every name in `names` (sorted, none twice) its number.
std::vector<std::uint32_t> number(ExactPoints& points, const std::vector<Triangle>& triangles,
                                  const std::vector<Named>& names, WatchedWork& work,
                                  const double share) {
  std::vector<ExactPoint> exact(names.size());
  std::vector<RoundedPoint> rounded(names.size());
  work.for_each(names.size(), share, [&](const std::size_t i) {
    const Named& name = names[i];
    if (name.triangle == kNoIndex) return;
    const ExactPlane plane = points.plane(triangles[name.triangle]);
    const WholeVector p = points.whole(name.low), q = points.whole(name.high);
    exact[i] = between(p, q, plane.height({p, 1}), plane.height({q, 1}));
    rounded[i] = points.round(exact[i]);
  });
  std::vector<std::uint32_t> numbers(names.size());
  for (std::size_t i = 0; i < names.size(); ++i)
    numbers[i] =
        names[i].triangle == kNoIndex ? names[i].low : points.add(std::move(exact[i]), rounded[i]);
  return numbers;
}

}  // namespace

std::vector<Meeting> find_meetings(ExactPoints& points, const std::vector<Triangle>& triangles,
                                   const std::span<const std::array<std::uint32_t, 2>> pairs,
                                   WatchedWork& work, const double share) {
  std::vector<Meeting> meetings(pairs.size());
  std::vector<std::vector<Named>> ends(pairs.size());
  work.for_each(pairs.size(), share / 2, [&](const std::size_t i) {
    const auto [a, b] = pairs[i];
    meetings[i].triangles = pairs[i];
    meetings[i].coplanar = !PairOfTriangles(points, triangles, ends[i]).add_ends(a, b);
  });
  std::vector<Named> names;
  for (const auto& of_pair : ends) names.insert(names.end(), of_pair.begin(), of_pair.end());
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  const std::vector<std::uint32_t> numbers = number(points, triangles, names, work, share / 2);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    Meeting& meeting = meetings[i];
    for (const Named& name : ends[i]) {
      const auto place = std::lower_bound(names.begin(), names.end(), name) - names.begin();
      const std::uint32_t p = numbers[static_cast<std::size_t>(place)];
      if (meeting.from == kNoIndex) meeting.from = meeting.to = p;
      if (p == meeting.from || p == meeting.to) continue;
      if (meeting.from != meeting.to)
        throw Unresolvable{"two triangles intersect in more than a segment"};
      meeting.to = p;
    }
    if (!meeting.coplanar && meeting.from == kNoIndex)
      throw Unresolvable{"two intersecting triangles have no common point"};
  }
  return meetings;
}

}  // namespace ist
