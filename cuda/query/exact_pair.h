#pragma once

#include <cstdint>

#include "query/exact/crossing.h"
#include "query/exact/overlap_formulas.h"

// A pair of triangles, by a single lane.

namespace ist::gpu {

enum class PairSays : std::uint32_t {
  apart,
  crosses,
  unsure,  ///< doubles do not tell
  wrong,   ///< signs contradict each other
};

/// An edge that goes through the other triangle.
struct PiercingEdge {
  std::uint32_t of_b, edge;  ///< edge k goes from corner k to the next
  exact::Point p, q;
  double height_p, height_q, error;
};

/// Heights of corners over the other triangle's plane.
template <bool kExactly>
IST_HD inline exact::Determinant height_of(const exact::Point& p, const exact::Point (&plane)[3],
                                           bool of_b, const exact::Point& aside) {
  return exact::determinant_of<kExactly>(p, plane[0], plane[1], plane[0], plane[2], plane[0],
                                         of_b ? 1 : -1, aside);
}

/// Where they cross, the edges that leave at the start of the segment that they share, and at its
/// end: A's edges leave B at the start and enter it at the end; B's enter A at the start.
template <bool kExactly>
IST_HD PairSays cross_pair(const exact::Point (&a)[3], const exact::Point (&b)[3],
                           const exact::Point& aside, PiercingEdge (&end)[2]) {
  exact::Determinant height[2][3];  // of A's corners over B's plane, of B's over A's
  bool unsure = false;
  const auto alike = [](const exact::Determinant(&h)[3]) {
    return h[0].sign == h[1].sign && h[1].sign == h[2].sign && h[0].sign != 0;
  };
  // Loops stay rolled: what runs seldom must not crowd the device's instruction cache.
  IST_ROLLED
  for (int s = 1; s >= 0; --s) {
    IST_ROLLED
    for (int k = 0; k < 3; ++k) {
      exact::Determinant& h = height[s][k];
      h = height_of<kExactly>(s == 1 ? b[k] : a[k], s == 1 ? a : b, s == 1, aside);
      unsure = unsure || h.sign == 0;
      // Where moving aside decides, the plane may lie on the other side of the corner.
      if (h.value * h.sign < 0) h.error += std::abs(h.value);
    }
    if (alike(height[s])) return PairSays::apart;
  }
  if (unsure) return PairSays::unsure;
  std::uint32_t parts[2] = {0, 0};  // edges that go through the other's plane
  IST_ROLLED
  for (int s = 0; s < 2; ++s)
    for (int k = 0; k < 3; ++k)
      parts[s] |= (height[s][k].sign != height[s][(k + 1) % 3].sign ? 1u : 0u) << k;
  std::uint32_t positive[3] = {0, 0, 0};  // of A's edge, a bit an edge of B's: the way round
  IST_ROLLED
  for (int n = 0; n < 9; ++n) {
    const int i = n / 3, j = n % 3;
    if (((parts[0] >> i | parts[1] >> j) & 1) == 0) continue;
    const exact::Point &p = a[i], &q = a[(i + 1) % 3], &r = b[j], &s = b[(j + 1) % 3];
    const int sign = exact::determinant_of<kExactly>(r, p, q, p, s, r, 1, aside).sign;
    unsure = unsure || sign == 0;
    positive[i] |= (sign > 0 ? 1u : 0u) << j;
  }
  if (unsure) return PairSays::unsure;
  int count[2] = {0, 0};
  const auto pierces = [&](int s, int k) {
    if ((parts[s] >> k & 1) == 0) return false;
    if (s == 0) return positive[k] == 0 || positive[k] == 7;
    const std::uint32_t bits =
        (positive[0] >> k & 1) + (positive[1] >> k & 1) + (positive[2] >> k & 1);
    return bits == 0 || bits == 3;
  };
  IST_ROLLED
  for (int n = 0; n < 6; ++n) {
    const int s = n / 3, k = n % 3;
    if (!pierces(s, k)) continue;
    const int next = (k + 1) % 3;
    const bool down = height[s][k].sign > 0;  // enters the other solid
    const int e = down == (s == 0) ? 1 : 0;
    ++count[e];
    end[e] = {static_cast<std::uint32_t>(s),
              static_cast<std::uint32_t>(k),
              s == 0 ? a[k] : b[k],
              s == 0 ? a[next] : b[next],
              height[s][k].value,
              height[s][next].value,
              height[s][k].error + height[s][next].error};
  }
  if (count[0] == 0 && count[1] == 0) return PairSays::apart;
  return count[0] == 1 && count[1] == 1 ? PairSays::crosses : PairSays::wrong;
}

}  // namespace ist::gpu
