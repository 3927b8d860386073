#pragma once

#include <cstdint>

#include "query/exact/orientation.h"

namespace ist::exact {

/// +1: the edge p → q goes down through the plane, into the other solid; −1: up.
IST_HD inline int direction(int sign_p) { return sign_p > 0 ? 1 : -1; }

/// What exact signs say of two triangles.
struct TriangleSigns {
  Determinant height[2][3];  ///< of A's corners over B's plane, of B's over A's
  /// Bit k: A's edge k, from corner k to the next, goes through B's triangle; bit 3 + k: B's edge k
  /// through A's. Two bits where they cross, none else, and then heights need not be there.
  std::uint32_t pierced = 0;
};

IST_HD inline TriangleSigns cross_exactly(const Point (&a)[3], const Point (&b)[3]) {
  TriangleSigns out;
  const auto alike = [](const Determinant(&h)[3]) {
    return h[0].sign == h[1].sign && h[1].sign == h[2].sign;
  };
  for (int k = 0; k < 3; ++k) out.height[1][k] = height_over_a(a, b[k]);
  if (alike(out.height[1])) return out;
  for (int k = 0; k < 3; ++k) out.height[0][k] = height_over_b(b, a[k]);
  if (alike(out.height[0])) return out;
  int round[3][3] = {};  // made when asked for, 0 until then
  const auto way = [&](int i, int j) {
    if (round[i][j] == 0) round[i][j] = way_round(a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3]).sign;
    return round[i][j];
  };
  const auto parts = [&](int side, int k) {
    return out.height[side][k].sign != out.height[side][(k + 1) % 3].sign;
  };
  for (int k = 0; k < 3; ++k) {
    if (parts(0, k) && way(k, 0) == way(k, 1) && way(k, 1) == way(k, 2)) out.pierced |= 1u << k;
    if (parts(1, k) && way(0, k) == way(1, k) && way(1, k) == way(2, k)) out.pierced |= 8u << k;
  }
  return out;
}

/// How often the way from p to q, both B's points or both A's, enters the other solid through one
/// of its triangles: 1, 0 or −1.
IST_HD inline int enters(const Point& p, const Point& q, const Point (&t)[3], bool of_b) {
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
