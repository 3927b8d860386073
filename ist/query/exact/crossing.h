#pragma once

#include <cstdint>

#include "query/exact/orientation.h"

namespace ist::exact {

/// Where an edge of one solid goes through a triangle of the other: an end of the segment that two
/// triangles share. All segments that end there have the same bits of it.
struct Piercing {
  Point from;    ///< the end of the edge that is nearer to the triangle's plane
  Point offset;  ///< from there to the place: it keeps its digits where that is next to the end
  double t = 0;  ///< of the way along the edge, from its first corner in this triangle
  double t_error = 0;  ///< of t
  double h_error = 0;  ///< heights of the edge's ends over the triangle, times twice its area, are
                       ///< off by this together
  std::int8_t edge = 0;    ///< edge k goes from corner k to the next
  bool from_first = true;  ///< `from` is the edge's first corner in this triangle
  bool of_b = false;       ///< the edge is B's and the triangle A's
};

/// Two triangles that cross: their common segment, from where B's side of A's triangle lies to the
/// left of it. A's edges leave B at the start and enter it at the end; B's edges enter A at the
/// start and leave it at the end.
struct Crossing {
  std::uint32_t a = 0, b = 0;  ///< triangles: 16 · block + lane
  Piercing start, end;
};

/// A triangle with the numbers of its corners, by which its edges are run the same way from
/// whichever triangle they are met.
struct Corners {
  Point x[3];
  std::uint32_t vertex[3];
};

/// +1: the edge p → q goes down through the plane, into the other solid; −1: up.
IST_ANYWHERE int direction(int sign_p) { return sign_p > 0 ? 1 : -1; }

/// An end of an edge: its number in the mesh, and its height over the triangle that the edge
/// pierces.
struct EdgeEnd {
  Point x;
  std::uint32_t vertex;
  double height, error;
};

/// Where edge `edge` of a triangle, from p to q, pierces another.
IST_ANYWHERE Piercing piercing(const EdgeEnd& p, const EdgeEnd& q, int edge, bool of_b) {
  const double hp = std::abs(p.height), hq = std::abs(q.height);
  const bool turned = hq < hp || (hq == hp && q.vertex < p.vertex);
  const double whole = hp + hq;  // > 0: an edge in the plane has both ends on one side
  const double t = whole > 0 ? (turned ? hq : hp) / whole : 0.5;
  const double error = p.error + q.error;
  Piercing out;
  out.from = turned ? q.x : p.x;
  out.offset = turned ? t * (p.x - q.x) : t * (q.x - p.x);
  out.t = turned ? 1 - t : t;
  out.t_error = whole > 0 ? 2 * error / whole + 1e-15 : 1;
  out.h_error = error;
  out.edge = static_cast<std::int8_t>(edge);
  out.from_first = !turned;
  out.of_b = of_b;
  return out;
}

/// Puts a piercing where it belongs.
IST_ANYWHERE void place(const Piercing& found, int sign_p, Crossing& out) {
  ((direction(sign_p) > 0) != found.of_b ? out.end : out.start) = found;
}

/// Whether the edge of an end enters the other solid there, or leaves it.
IST_ANYWHERE bool enters(const Crossing& crossing, const Piercing& end) {
  return (&end == &crossing.start) == end.of_b;
}

/// How many ends the common segment of two triangles has, by exact signs: two where they cross,
/// none else. `out` but for the triangles' numbers.
IST_ANYWHERE int cross_exactly(const Corners& a, const Corners& b, Crossing& out) {
  Determinant of_b[3], of_a[3];
  for (int k = 0; k < 3; ++k) of_b[k] = height_over_a(a.x, b.x[k]);
  if (of_b[0].sign == of_b[1].sign && of_b[1].sign == of_b[2].sign) return 0;
  for (int k = 0; k < 3; ++k) of_a[k] = height_over_b(b.x, a.x[k]);
  if (of_a[0].sign == of_a[1].sign && of_a[1].sign == of_a[2].sign) return 0;
  int round[3][3] = {};  // made when asked for, 0 until then
  const auto way = [&](int i, int j) {
    if (round[i][j] == 0)
      round[i][j] = way_round(a.x[i], a.x[(i + 1) % 3], b.x[j], b.x[(j + 1) % 3]).sign;
    return round[i][j];
  };
  const auto end = [](const Corners& triangle, int k, const Determinant(&height)[3]) {
    return EdgeEnd{triangle.x[k], triangle.vertex[k], height[k].value, height[k].error};
  };
  int ends = 0;
  for (int k = 0; k < 3; ++k)
    if (of_a[k].sign != of_a[(k + 1) % 3].sign && way(k, 0) == way(k, 1) &&
        way(k, 1) == way(k, 2)) {
      place(piercing(end(a, k, of_a), end(a, (k + 1) % 3, of_a), k, false), of_a[k].sign, out);
      ++ends;
    }
  for (int k = 0; k < 3; ++k)
    if (of_b[k].sign != of_b[(k + 1) % 3].sign && way(0, k) == way(1, k) &&
        way(1, k) == way(2, k)) {
      place(piercing(end(b, k, of_b), end(b, (k + 1) % 3, of_b), k, true), of_b[k].sign, out);
      ++ends;
    }
  return ends;
}

/// How often the way from p to q, both B's points or both A's, enters the other solid through one
/// of its triangles: 1, 0 or −1.
IST_ANYWHERE int enters(const Point& p, const Point& q, const Point (&t)[3], bool of_b) {
  int sign[2], way[3];
  for (int k = 0; k < 2; ++k)
    sign[k] = (of_b ? height_over_a(t, k == 0 ? p : q) : height_over_b(t, k == 0 ? p : q)).sign;
  if (sign[0] == sign[1]) return 0;
  for (int k = 0; k < 3; ++k)
    way[k] =
        (of_b ? way_round(t[k], t[(k + 1) % 3], p, q) : way_round(p, q, t[k], t[(k + 1) % 3])).sign;
  return way[0] == way[1] && way[1] == way[2] ? direction(sign[0]) : 0;
}

}  // namespace ist::exact
