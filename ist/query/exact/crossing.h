#pragma once

#include <cstdint>

#include "query/exact/orientation.h"

namespace ist::exact {

/// +1 if the edge p → q enters the other solid through the plane, −1 if it leaves.
IST_HD inline int direction(int sign_p) { return sign_p > 0 ? 1 : -1; }

/// True if triangles of A and B cross, with B not translated.
IST_HD inline bool cross_exactly(const Point (&a)[3], const Point (&b)[3]) {
  const Point still = {0, 0, 0};
  int height[2][3];
  const auto alike = [](const int(&h)[3]) { return h[0] == h[1] && h[1] == h[2]; };
  for (int k = 0; k < 3; ++k) height[1][k] = height_over_a(a, b[k], still).sign;
  if (alike(height[1])) return false;
  for (int k = 0; k < 3; ++k) height[0][k] = height_over_b(b, a[k], still).sign;
  if (alike(height[0])) return false;
  const auto round = [&](int i, int j) {
    return way_round(a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3], still).sign;
  };
  for (int k = 0; k < 3; ++k) {
    if (height[0][k] != height[0][(k + 1) % 3] && round(k, 0) == round(k, 1) &&
        round(k, 1) == round(k, 2))
      return true;
    if (height[1][k] != height[1][(k + 1) % 3] && round(0, k) == round(1, k) &&
        round(1, k) == round(2, k))
      return true;
  }
  return false;
}

/// 1 if the line from p to q, two points of B or of A, enters the other solid through one of its
/// triangles, −1 if it leaves, else 0. `unsure`: doubles do not decide, without `kExactly`.
template <bool kExactly = true>
IST_HD inline int enters(const Point& p, const Point& q, const Point (&t)[3], bool of_b,
                         const Point& aside, bool& unsure) {
  int sign[2], way[3];
  bool all = true;
  for (int k = 0; k < 2; ++k) {
    sign[k] = (of_b ? height_over_a<kExactly>(t, k == 0 ? p : q, aside)
                    : height_over_b<kExactly>(t, k == 0 ? p : q, aside))
                  .sign;
    all = all && sign[k] != 0;
  }
  if (all && sign[0] == sign[1]) return 0;
  for (int k = 0; k < 3; ++k) {
    way[k] = (of_b ? way_round<kExactly>(t[k], t[(k + 1) % 3], p, q, aside)
                   : way_round<kExactly>(p, q, t[k], t[(k + 1) % 3], aside))
                 .sign;
    all = all && way[k] != 0;
  }
  // Two different signs prove that the line misses the triangle, whatever the third is.
  const int least =
      way[0] < way[1] ? (way[0] < way[2] ? way[0] : way[2]) : (way[1] < way[2] ? way[1] : way[2]);
  const int most =
      way[0] > way[1] ? (way[0] > way[2] ? way[0] : way[2]) : (way[1] > way[2] ? way[1] : way[2]);
  if (least < 0 && most > 0) return 0;
  unsure = unsure || !all;
  return all ? direction(sign[0]) : 0;
}
IST_HD inline int enters(const Point& p, const Point& q, const Point (&t)[3], bool of_b,
                         const Point& aside) {
  bool unsure = false;
  return enters<true>(p, q, t, of_b, aside, unsure);
}

}  // namespace ist::exact
