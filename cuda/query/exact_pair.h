#pragma once

#include <cstdint>

#include "query/exact/crossing.h"
#include "query/exact/overlap_formulas.h"

// A pair of triangles, by a single lane.

namespace ist::gpu {

/// By which signs a pair is told.
enum class Signs {
  doubles,
  exact,
  settled,  ///< doubles, where they are the same wherever points move by the room
};

enum class PairSays : std::uint32_t {
  apart,
  crosses,
  unsure,  ///< the signs do not tell
  wrong,   ///< signs contradict each other
};

/// What lanes index by what they differ in: as arrays of their own it would lie in slow memory.
struct CornerMemory {
  double x[2][3][3][32];                    ///< of A, of B: of a corner
  double value[2][3][32], error[2][3][32];  ///< heights over the other's plane
};

/// A lane's.
struct CornerView {
  CornerMemory& memory;
  int lane;

  IST_HD exact::Point corner(int s, int k) const {
    const auto& x = memory.x[s][k];
    return {x[0][lane], x[1][lane], x[2][lane]};
  }
  IST_HD void set(int s, int k, const exact::Point& x) const {
    for (int axis = 0; axis < 3; ++axis) memory.x[s][k][axis][lane] = x[axis];
  }
  IST_HD double& value(int s, int k) const { return memory.value[s][k][lane]; }
  IST_HD double& error(int s, int k) const { return memory.error[s][k][lane]; }
};

/// An edge that goes through the other triangle; edge k goes from corner k to the next.
struct PiercingEdge {
  std::uint32_t of_b, edge;
};

IST_HD inline double largest(const exact::Point& x) {
  return std::fmax(std::abs(x.x), std::fmax(std::abs(x.y), std::abs(x.z)));
}
/// What moving points by the room does to a height of r: six products of three numbers.
IST_HD inline double moved_height(double room, double longest, const exact::Point& r) {
  return 6 * room * longest * (2 * largest(r) + longest);
}

/// Which way round an edge of A goes about one of B's; 0: unsure.
template <Signs kBy>
IST_HD int way_sign(const exact::Point& p, const exact::Point& q, const exact::Point& r,
                    const exact::Point& s, const exact::Point& aside, double room) {
  if constexpr (kBy != Signs::settled)
    return exact::way_round<kBy == Signs::exact>(p, q, r, s, aside).sign;
  const exact::Point u = q - p, v = s - r, between = r - p;
  const double of_a = largest(u) + room, of_b = largest(v) + room, size = largest(between + aside);
  return exact::FilteredPlane(u, v, aside)
      .height(between, 6 * room * (of_a * of_b + size * (of_a + of_b)))
      .sign;
}

/// Where they cross, the edges that leave at the start of the segment that they share, and at its
/// end: A's edges leave B at the start and enter it at the end; B's enter A at the start.
template <Signs kBy>
IST_HD PairSays cross_pair(const CornerView& pair, const exact::Point& aside,
                           PiercingEdge (&end)[2], double room = 0) {
  bool unsure = false;
  std::uint32_t above[2] = {0, 0};  // a bit a corner
  // Loops stay rolled: what runs seldom must not crowd the device's instruction cache.
  IST_ROLLED
  for (int s = 1; s >= 0; --s) {
    std::uint32_t bits = 0;
    bool all = true;
    const exact::Point o = pair.corner(1 - s, 0), p = pair.corner(1 - s, 1),
                       q = pair.corner(1 - s, 2);
    const int moved = s == 1 ? 1 : -1;
    const exact::FilteredPlane plane(p - o, q - o, moved * aside);
    const double longest = std::fmax(largest(p - o), largest(q - o)) + room;
    IST_ROLLED
    for (int k = 0; k < 3; ++k) {
      const exact::Point x = pair.corner(s, k);
      exact::Determinant h = kBy == Signs::settled
                                 ? plane.height(x - o, moved_height(room, longest, x - o))
                                 : plane.height(x - o);
      if constexpr (kBy == Signs::exact)
        if (h.sign == 0) h = exact::exact_determinant(x, o, p, o, q, o, moved, aside);
      all = all && h.sign != 0;
      bits |= (h.sign > 0 ? 1u : 0u) << k;
      pair.value(s, k) = h.value;
      // Where moving aside decides, the plane may lie on the other side of the corner.
      pair.error(s, k) = h.error + (h.value * h.sign < 0 ? std::abs(h.value) : 0);
    }
    if (all && (bits == 0 || bits == 7)) return PairSays::apart;
    unsure = unsure || !all;
    (s == 0 ? above[0] : above[1]) = bits;
  }
  if (unsure) return PairSays::unsure;
  // Edges that go through the other's plane.
  const auto changes = [](std::uint32_t bits) { return bits ^ (bits >> 1 | (bits & 1) << 2); };
  const std::uint32_t parts[2] = {changes(above[0]), changes(above[1])};
  std::uint32_t known = 0, positive = 0;  // the way round: bit 3 · edge of A + edge of B
  IST_ROLLED
  for (int n = 0; n < 9; ++n) {
    const int i = n / 3, j = n % 3;
    if (((parts[0] >> i | parts[1] >> j) & 1) == 0) continue;
    const int sign = way_sign<kBy>(pair.corner(0, i), pair.corner(0, (i + 1) % 3),
                                   pair.corner(1, j), pair.corner(1, (j + 1) % 3), aside, room);
    known |= (sign != 0 ? 1u : 0u) << n;
    positive |= (sign > 0 ? 1u : 0u) << n;
  }
  int count[2] = {0, 0};
  IST_ROLLED
  for (std::uint32_t n = 0; n < 6; ++n) {
    const std::uint32_t s = n / 3, k = n % 3;
    const std::uint32_t all = s == 0 ? 7u << 3 * k : 0b1001001u << k, bits = positive & all;
    // Ways round that differ from each other keep it outside whatever the others are.
    if (((s == 0 ? parts[0] : parts[1]) >> k & 1) == 0 || (bits != 0 && bits != (known & all)))
      continue;
    if ((known & all) != all) return PairSays::unsure;
    const bool down = ((s == 0 ? above[0] : above[1]) >> k & 1) != 0;  // enters the other solid
    const bool at_end = down == (s == 0);
    ++(at_end ? count[1] : count[0]);
    (at_end ? end[1] : end[0]) = {s, k};
  }
  if (count[0] == 0 && count[1] == 0) return PairSays::apart;
  return count[0] == 1 && count[1] == 1 ? PairSays::crosses : PairSays::wrong;
}

}  // namespace ist::gpu
