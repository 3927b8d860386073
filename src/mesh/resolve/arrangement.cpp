#include "mesh/resolve/arrangement.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "mesh/connectivity/disjoint_sets.h"
#include "mesh/connectivity/surface_reduction.h"

namespace ist {
namespace {

/// The common points of two triangles: in one plane, or a segment.
struct Meeting {
  std::array<std::uint32_t, 2> triangles;
  bool coplanar = false;
  std::uint32_t from = kNoIndex, to = kNoIndex;  ///< points; equal if it is one point
};

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

  /// Adds the ends of the common segment of two triangles; false if they lie in one plane.
  bool add_ends(std::uint32_t a, std::uint32_t b) {
    const Sides of_a = sides(b, a), of_b = sides(a, b);
    if (of_a == Sides{0, 0, 0}) return false;
    add_crossings(a, of_a, b);
    add_crossings(b, of_b, a);
    return true;
  }

 private:
  using Sides = std::array<int, 3>;

  /// The sides of triangle `plane` on which the corners of t are.
  Sides sides(std::uint32_t plane, std::uint32_t t) const {
    const Triangle& of = triangles_[plane];
    Sides result;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = triangles_[t][k];
      result[k] = v == of[0] || v == of[1] || v == of[2] ? 0 : points_.side(of, points_.view(v));
    }
    return result;
  }

  /// Corners and edges of t that meet the closed triangle `other` without lying along it.
  void add_crossings(std::uint32_t t, const Sides& side, std::uint32_t other) {
    const Triangle &corner = triangles_[t], &of = triangles_[other];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t p = corner[k], q = corner[(k + 1) % 3];
      if (side[k] == 0 && holds(of, p)) found_.push_back({p, p});
      if (side[k] * side[(k + 1) % 3] < 0 && is_pierced(of, p, q))
        found_.push_back({std::min(p, q), std::max(p, q), other});
    }
  }

  /// True if a closed triangle contains a vertex in its plane.
  bool holds(const Triangle& t, std::uint32_t p) const {
    if (p == t[0] || p == t[1] || p == t[2]) return true;
    int k = 0;
    while (k < 2 && points_.turn(k, t[0], t[1], t[2]) == 0) ++k;
    return same_turn(points_.turn(k, t[0], t[1], p), points_.turn(k, t[1], t[2], p),
                     points_.turn(k, t[2], t[0], p));
  }

  /// True if the line pq, which crosses the plane of t, meets the closed triangle.
  bool is_pierced(const Triangle& t, std::uint32_t p, std::uint32_t q) const {
    const auto around = [&](std::uint32_t a, std::uint32_t b) {
      return a == p || a == q || b == p || b == q ? 0 : points_.side({p, q, a}, points_.view(b));
    };
    return same_turn(around(t[0], t[1]), around(t[1], t[2]), around(t[2], t[0]));
  }

  static bool same_turn(int a, int b, int c) {
    return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
  }

  const ExactPoints& points_;
  const std::vector<Triangle>& triangles_;
  std::vector<Named>& found_;
};

/// Numbers every name in `names` (sorted, unique).
std::vector<std::uint32_t> number(ExactPoints& points, const std::vector<Triangle>& triangles,
                                  const std::vector<Named>& names, WatchedWork& work,
                                  double share) {
  std::vector<ExactPoint> exact(names.size());
  std::vector<RoundedPoint> rounded(names.size());
  work.for_each(names.size(), share, [&](std::size_t i) {
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

/// The meetings of pairs of triangles that meet, in their order. New points are added in an order
/// that does not depend on threads. Throws Unresolvable if the pairs are contradictory, and as
/// `work` does. `share`: the part of `work`.
std::vector<Meeting> find_meetings(ExactPoints& points, const std::vector<Triangle>& triangles,
                                   const std::span<const std::array<std::uint32_t, 2>> pairs,
                                   WatchedWork& work, double share) {
  std::vector<Meeting> meetings(pairs.size());
  std::vector<std::vector<Named>> ends(pairs.size());
  work.for_each(pairs.size(), share / 2, [&](std::size_t i) {
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

/// Each takes some 600 bytes and 10 µs.
constexpr std::size_t kMostCrossings = 500'000;

/// Approximate shares of the whole work.
constexpr double kMeetings = 0.2, kCuts = 0.2, kPieces = 0.4;

/// A segment in the plane of a cluster: a side of one of its triangles, or the intersection of one
/// with another triangle, in the plane `other`.
struct Segment {
  std::uint32_t from, to;
  std::uint32_t other = kNoIndex;
  std::vector<std::uint32_t> on = {};  ///< points on it, its ends among them
  std::size_t like = 0;                ///< the first with the same ends, which alone has points

  bool is_side() const { return other == kNoIndex; }
};

/// The point where two segments cross between their ends.
struct CutCrossing {
  std::array<std::size_t, 2> segments;
  ExactPoint exact;
  RoundedPoint rounded;
};

/// Triangles in one plane that meet, and their cuts.
struct Cluster {
  std::vector<std::uint32_t> triangles;
  std::vector<Segment> segments = {};
  std::vector<std::uint32_t> touched = {};  ///< points touched by other triangles
  std::vector<CutCrossing> crossings = {};
  std::vector<PlanarTriangulation::Covered> pieces = {};
  int axis = 0;  ///< the plane does not project to a line along it
};

class ClusterWork {
 public:
  ClusterWork(const ExactPoints& points, const std::vector<Triangle>& triangles, Cluster& cluster,
              const WorkStop& stop)
      : points_(points), triangles_(triangles), cluster_(cluster), stop_(stop) {}

  void choose_axis() {
    const Triangle& t = triangles_[cluster_.triangles[0]];
    const Eigen::Vector3d& a = points_.rounded(t[0]);
    const Eigen::Vector3d normal =
        (points_.rounded(t[1]) - a).cross(points_.rounded(t[2]) - a).cwiseAbs();
    normal.maxCoeff(&cluster_.axis);
    for (int tried = 0; points_.turn(cluster_.axis, t[0], t[1], t[2]) == 0; ++tried) {
      if (tried == 3) throw Unresolvable{"a triangle that intersects others is degenerate"};
      cluster_.axis = (cluster_.axis + 1) % 3;
    }
  }

  /// Assigns points to the segments that contain them and finds the crossings of segments.
  /// `crossings`: the number in all clusters so far.
  void meet(std::atomic<std::size_t>& crossings) {
    std::vector<Segment>& segments = cluster_.segments;
    std::vector<std::size_t> order(segments.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    const auto ends = [&](std::size_t i) { return std::minmax(segments[i].from, segments[i].to); };
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t i, std::size_t j) { return ends(i) < ends(j); });
    for (std::size_t i = 0; i < order.size(); ++i)
      segments[order[i]].like =
          i > 0 && ends(order[i]) == ends(order[i - 1]) ? segments[order[i - 1]].like : order[i];
    std::erase_if(order, [&](std::size_t i) { return segments[i].like != i; });
    std::vector<Range> x(segments.size()), y(segments.size());
    for (const std::size_t i : order) {
      segments[i].on = {segments[i].from, segments[i].to};
      x[i] = range(segments[i], first());
      y[i] = range(segments[i], second());
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t i, std::size_t j) { return x[i].low < x[j].low; });
    std::vector<std::uint32_t>& touched = cluster_.touched;
    const auto place_of = [&](std::uint32_t p) { return points_.rounded(p)[first()]; };
    std::sort(touched.begin(), touched.end(), [&](std::uint32_t p, std::uint32_t q) {
      return std::pair(place_of(p), p) < std::pair(place_of(q), q);
    });
    for (std::size_t place = 0; place < order.size(); ++place) {
      stop_.look();
      const std::size_t i = order[place];
      for (auto p = std::partition_point(touched.begin(), touched.end(),
                                         [&](const auto q) { return place_of(q) < x[i].low; });
           p != touched.end() && place_of(*p) <= x[i].high; ++p)
        put(*p, segments[i]);
      for (std::size_t next = place + 1; next < order.size(); ++next) {
        const std::size_t j = order[next];
        if (x[j].low > x[i].high) break;
        if (y[j].low > y[i].high || y[i].low > y[j].high || !meet(i, j)) continue;
        if (++crossings > kMostCrossings)
          throw Unresolvable{"too many triangles intersect at the same places"};
      }
    }
  }

  void triangulate(const std::array<std::uint32_t, 3>& frame) {
    std::vector<std::uint32_t> inner = cluster_.touched;
    const auto along = [&](std::uint32_t p, std::uint32_t q) {
      const int by_first = points_.compare(first(), p, q);
      return by_first != 0 ? by_first < 0 : points_.compare(second(), p, q) < 0;
    };
    for (Segment& s : cluster_.segments) {
      std::sort(s.on.begin(), s.on.end());
      s.on.erase(std::unique(s.on.begin(), s.on.end()), s.on.end());
      inner.insert(inner.end(), s.on.begin(), s.on.end());
      std::sort(s.on.begin(), s.on.end(), along);
    }
    std::sort(inner.begin(), inner.end());
    inner.erase(std::unique(inner.begin(), inner.end()), inner.end());
    PlanarTriangulation plane(points_, cluster_.axis, frame, inner);
    for (std::size_t place = 0; place < cluster_.segments.size(); ++place) {
      const Segment& s = cluster_.segments[place];
      stop_.look();
      const std::vector<std::uint32_t>& on = cluster_.segments[s.like].on;
      const int step = !s.is_side() ? 0 : on.front() == s.from ? 1 : -1;
      const std::size_t facing = s.is_side() ? facing_of(place) : 0;
      for (std::size_t k = 0; k + 1 < on.size(); ++k) plane.insert(on[k], on[k + 1], step, facing);
    }
    plane.make_round();
    cluster_.pieces = plane.covered();
  }

 private:
  struct Range {
    double low, high;
  };

  /// 1 for sides of triangles that face away from the viewer.
  std::size_t facing_of(std::size_t side) const {
    const Triangle& t = triangles_[cluster_.triangles[side / 3]];
    return turn(t[0], t[1], t[2]) < 0 ? 1 : 0;
  }
  int first() const { return (cluster_.axis + 1) % 3; }
  int second() const { return (cluster_.axis + 2) % 3; }
  int turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    return points_.turn(cluster_.axis, a, b, c);
  }
  Range range(const Segment& s, int k) const {
    const auto [low, high] = std::minmax(points_.rounded(s.from)[k], points_.rounded(s.to)[k]);
    return {low, high};
  }

  /// True if p, on the line through s, lies on s.
  bool within(std::uint32_t p, const Segment& s) const {
    for (const int k : {first(), second()})
      if (points_.compare(k, s.from, p) * points_.compare(k, p, s.to) < 0) return false;
    return true;
  }
  void put(std::uint32_t p, Segment& s) const {
    for (const int k : {first(), second()}) {
      const Range r = range(s, k);
      if (points_.rounded(p)[k] < r.low || points_.rounded(p)[k] > r.high) return;
    }
    if (turn(s.from, s.to, p) == 0 && within(p, s)) s.on.push_back(p);
  }

  /// True if they cross between their ends.
  bool meet(std::size_t i, std::size_t j) {
    Segment &a = cluster_.segments[i], &b = cluster_.segments[j];
    for (const auto& [shared, end] : {std::pair(a.from, a.to), std::pair(a.to, a.from)})
      if ((shared == b.from || shared == b.to) &&
          turn(shared, end, shared == b.from ? b.to : b.from) != 0)
        return false;
    const int from = turn(a.from, a.to, b.from), to = turn(a.from, a.to, b.to);
    if (from * to > 0) return false;
    const int back_from = turn(b.from, b.to, a.from), back_to = turn(b.from, b.to, a.to);
    if (back_from * back_to > 0) return false;
    if (from * to < 0 && back_from * back_to < 0) {
      ExactPoint exact = crossing(a, b);
      const RoundedPoint rounded = points_.round(exact);
      cluster_.crossings.push_back({{i, j}, std::move(exact), rounded});
      return true;
    }
    if (from == 0 && within(b.from, a)) a.on.push_back(b.from);
    if (to == 0 && within(b.to, a)) a.on.push_back(b.to);
    if (back_from == 0 && within(a.from, b)) b.on.push_back(a.from);
    if (back_to == 0 && within(a.to, b)) b.on.push_back(a.to);
    return false;
  }

  ExactPoint crossing(const Segment& a, const Segment& b) const {
    if (!a.is_side() && !b.is_side())
      return common_point(points_.plane(triangles_[cluster_.triangles[0]]),
                          points_.plane(triangles_[a.other]), points_.plane(triangles_[b.other]));
    const Segment &side = a.is_side() ? a : b, &cut = a.is_side() ? b : a;
    const WholeVector p = points_.whole(side.from), q = points_.whole(side.to);
    if (!cut.is_side()) {
      const ExactPlane plane = points_.plane(triangles_[cut.other]);
      return between(p, q, plane.height({p, 1}), plane.height({q, 1}));
    }
    const WholeVector r = points_.whole(cut.from), s = points_.whole(cut.to);
    const auto x = static_cast<std::size_t>(first()), y = static_cast<std::size_t>(second());
    const auto area = [&](const WholeVector& c) {
      return (s[x] - r[x]) * (c[y] - r[y]) - (s[y] - r[y]) * (c[x] - r[x]);
    };
    return between(p, q, area(p), area(q));
  }

  const ExactPoints& points_;
  const std::vector<Triangle>& triangles_;
  Cluster& cluster_;
  const WorkStop& stop_;
};

using Frames = std::array<std::array<std::uint32_t, 3>, 3>;

/// For each axis, three points that surround all others in projection.
Frames add_frames(ExactPoints& points) {
  double largest = 0;
  for (std::uint32_t p = 0; p < points.size(); ++p)
    largest = std::max(largest, points.rounded(p).cwiseAbs().maxCoeff());
  const double reach = std::exp2(std::ceil(std::log2(largest)) + 2);
  Frames frames;
  for (int axis = 0; axis < 3; ++axis)
    for (std::size_t i = 0; i < 3; ++i) {
      Eigen::Vector3d p = Eigen::Vector3d::Constant(-4 * reach);
      p[axis] = 0;
      if (i > 0) p[(axis + static_cast<int>(i)) % 3] = 12 * reach;
      frames[static_cast<std::size_t>(axis)][i] = points.add(p);
    }
  return frames;
}

/// Clusters of the triangles in `meetings`, with their segments; [triangle] its cluster.
std::vector<Cluster> make_clusters(const std::vector<Triangle>& triangles,
                                   const std::vector<Meeting>& meetings,
                                   const std::vector<std::uint32_t>& plane,
                                   std::vector<std::uint32_t>& cluster_of) {
  cluster_of.assign(triangles.size(), kNoIndex);
  for (const Meeting& m : meetings)
    for (const std::uint32_t t : m.triangles) cluster_of[t] = 0;
  std::vector<Cluster> clusters;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (cluster_of[t] == kNoIndex) continue;
    if (plane[t] == t) {
      cluster_of[t] = static_cast<std::uint32_t>(clusters.size());
      clusters.emplace_back();
    } else {
      cluster_of[t] = cluster_of[plane[t]];
    }
    Cluster& cluster = clusters[cluster_of[t]];
    cluster.triangles.push_back(t);
    for (std::size_t k = 0; k < 3; ++k)
      cluster.segments.push_back({triangles[t][k], triangles[t][(k + 1) % 3]});
  }
  for (const Meeting& m : meetings) {
    if (m.coplanar) continue;
    const auto [a, b] = m.triangles;
    for (const auto& [t, other] : {std::pair(a, b), std::pair(b, a)}) {
      Cluster& cluster = clusters[cluster_of[t]];
      if (m.from == m.to)
        cluster.touched.push_back(m.from);
      else
        cluster.segments.push_back({std::min(m.from, m.to), std::max(m.from, m.to), other});
    }
  }
  return clusters;
}

/// Keeps one of several cuts with the same ends.
void drop_copies(Cluster& cluster) {
  std::vector<Segment>& s = cluster.segments;
  const auto cuts = s.begin() + static_cast<std::ptrdiff_t>(3 * cluster.triangles.size());
  const auto ends = [](const Segment& cut) { return std::pair(cut.from, cut.to); };
  std::stable_sort(cuts, s.end(), [&](const auto& a, const auto& b) { return ends(a) < ends(b); });
  s.erase(
      std::unique(cuts, s.end(), [&](const auto& a, const auto& b) { return ends(a) == ends(b); }),
      s.end());
  std::sort(cluster.touched.begin(), cluster.touched.end());
  cluster.touched.erase(std::unique(cluster.touched.begin(), cluster.touched.end()),
                        cluster.touched.end());
}

}  // namespace

Arrangement arrange(const std::vector<Eigen::Vector3d>& vertices,
                    const std::vector<Triangle>& triangles,
                    const std::span<const std::array<std::uint32_t, 2>> pairs, WatchedWork& work) {
  Arrangement out{ExactPoints(vertices), {}, {}, {}, {}, {}};
  const std::vector<Meeting> meetings =
      find_meetings(out.points, triangles, pairs, work, kMeetings);
  const Frames frames = add_frames(out.points);
  DisjointSets planes(triangles.size());
  for (const Meeting& m : meetings)
    if (m.coplanar) planes.unite(m.triangles[0], m.triangles[1]);
  out.plane.resize(triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) out.plane[t] = planes.find(t);
  std::vector<std::uint32_t> cluster_of;
  std::vector<Cluster> clusters = make_clusters(triangles, meetings, out.plane, cluster_of);
  const auto on = [&](Cluster& cluster) {
    return ClusterWork(out.points, triangles, cluster, work);
  };
  std::atomic<std::size_t> crossings{0};
  work.for_each(clusters.size(), kCuts, [&](std::size_t c) {
    drop_copies(clusters[c]);
    on(clusters[c]).choose_axis();
    on(clusters[c]).meet(crossings);
  });
  for (Cluster& cluster : clusters)
    for (CutCrossing& crossing : cluster.crossings) {
      const std::uint32_t p = out.points.add(std::move(crossing.exact), crossing.rounded);
      for (const std::size_t s : crossing.segments) cluster.segments[s].on.push_back(p);
    }
  work.for_each(clusters.size(), kPieces, [&](std::size_t c) {
    on(clusters[c]).triangulate(frames[static_cast<std::size_t>(clusters[c].axis)]);
  });
  const auto add = [&](const Triangle& corners, std::uint32_t source, int step) {
    out.pieces.push_back(step > 0 ? corners : Triangle{corners[0], corners[2], corners[1]});
    out.source.push_back(source);
    out.winding_step.push_back(std::abs(step));
  };
  const auto add_pieces = [&](const Cluster& cluster, std::uint32_t source) {
    bool wall = false;
    for (const auto& [corners, winding] : cluster.pieces) {
      if (winding[0] + winding[1] != 0) add(corners, source, winding[0] + winding[1]);
      wall |= winding[0] != 0 && winding[1] != 0;
    }
    if (wall) out.walls.push_back(source);
  };
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (cluster_of[t] == kNoIndex) {
      if (!is_degenerate(vertices, triangles[t])) add(triangles[t], t, 1);
    } else if (out.plane[t] == t) {
      add_pieces(clusters[cluster_of[t]], t);
    }
  }
  return out;
}

}  // namespace ist
