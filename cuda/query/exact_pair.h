#pragma once

#include <cstdint>

#include "base/bits.h"
#include "query/exact/crossing.h"
#include "query/exact/overlap_formulas.h"

// A pair of triangles, by a single lane.

namespace ist::gpu {

/// By which signs a pair is told.
enum class Signs {
  doubles,
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
  std::uint32_t asked[9];                   ///< of exact signs, by what they are: a bit a lane
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
  IST_HD double value(int s, int k) const { return memory.value[s][k][lane]; }
  IST_HD double error(int s, int k) const { return memory.error[s][k][lane]; }
  /// Keeps a corner's height; sets a bit where it lies above, or where its sign is not known.
  IST_HD void keep(int s, int k, const exact::Determinant& height, int bit, std::uint32_t& above,
                   std::uint32_t& unknown) const {
    memory.value[s][k][lane] = height.value;
    // Where moving aside decides, the plane may lie on the other side of the corner.
    memory.error[s][k][lane] =
        height.error + (height.value * height.sign < 0 ? std::abs(height.value) : 0);
    above |= (height.sign > 0 ? 1u : 0u) << bit;
    unknown |= (height.sign == 0 ? 1u : 0u) << bit;
  }
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

/// Which corners of a side lie above the other's triangle, a bit each; those that are `unknown`.
template <Signs kBy>
IST_HD std::uint32_t corners_above(const CornerView& pair, int s, const exact::Point& aside,
                                   double room, std::uint32_t& unknown) {
  const exact::Point o = pair.corner(1 - s, 0), p = pair.corner(1 - s, 1) - o,
                     q = pair.corner(1 - s, 2) - o;
  const exact::FilteredPlane plane(p, q, (s == 1 ? 1 : -1) * aside);
  const double longest = std::fmax(largest(p), largest(q)) + room;
  std::uint32_t bits = 0;
  unknown = 0;
  // Loops stay rolled: what runs seldom must not crowd the device's instruction cache.
  IST_ROLLED
  for (int k = 0; k < 3; ++k) {
    const exact::Point r = pair.corner(s, k) - o;
    pair.keep(
        s, k,
        kBy == Signs::settled ? plane.height(r, moved_height(room, longest, r)) : plane.height(r),
        k, bits, unknown);
  }
  return bits;
}

/// Edges that go through the other's plane, a bit each.
IST_HD inline std::uint32_t edges_through(std::uint32_t above) {
  return above ^ (above >> 1 | (above & 1) << 2);
}

/// Which ways round A's edges go about B's, a bit each: 3 · A's + B's.
struct WaysRound {
  std::uint32_t asked = 0, known = 0, positive = 0;
};
/// Asks those of edges that go through the other's plane.
template <Signs kBy>
IST_HD WaysRound ways_round(const CornerView& pair, const std::uint32_t (&through)[2],
                            const exact::Point& aside, double room) {
  WaysRound ways;
  IST_ROLLED
  for (int n = 0; n < 9; ++n) {
    const int i = n / 3, j = n % 3;
    if (((through[0] >> i | through[1] >> j) & 1) == 0) continue;
    const exact::Point p = pair.corner(0, i), r = pair.corner(1, j), between = r - p;
    const exact::Point u = pair.corner(0, (i + 1) % 3) - p, v = pair.corner(1, (j + 1) % 3) - r;
    double moved = 0;
    if constexpr (kBy == Signs::settled) {
      const double of_a = largest(u) + room, of_b = largest(v) + room,
                   size = largest(between + aside);
      moved = 6 * room * (of_a * of_b + size * (of_a + of_b));
    }
    const int sign = exact::FilteredPlane(u, v, aside).height(between, moved).sign;
    ways.asked |= 1u << n;
    ways.known |= (sign != 0 ? 1u : 0u) << n;
    ways.positive |= (sign > 0 ? 1u : 0u) << n;
  }
  return ways;
}

/// Where they cross, the edges that leave at the start of the segment that they share, and at its
/// end: A's edges leave B at the start and enter it at the end; B's enter A at the start.
/// `above`: of A's corners, of B's.
IST_HD inline PairSays find_ends(const std::uint32_t (&above)[2], const std::uint32_t (&through)[2],
                                 const WaysRound& ways, PiercingEdge (&end)[2]) {
  int count[2] = {0, 0};
  IST_ROLLED
  for (std::uint32_t n = 0; n < 6; ++n) {
    const std::uint32_t s = n / 3, k = n % 3;
    const std::uint32_t all = s == 0 ? 7u << 3 * k : 0b1001001u << k, bits = ways.positive & all;
    // Ways round that differ from each other keep it outside whatever the others are.
    if (((s == 0 ? through[0] : through[1]) >> k & 1) == 0 ||
        (bits != 0 && bits != (ways.known & all)))
      continue;
    if ((ways.known & all) != all) return PairSays::unsure;
    const bool down = ((s == 0 ? above[0] : above[1]) >> k & 1) != 0;  // enters the other solid
    const bool at_end = down == (s == 0);
    ++(at_end ? count[1] : count[0]);
    (at_end ? end[1] : end[0]) = {s, k};
  }
  if (count[0] == 0 && count[1] == 0) return PairSays::apart;
  return count[0] == 1 && count[1] == 1 ? PairSays::crosses : PairSays::wrong;
}

/// What doubles say of a lane's pair.
template <Signs kBy>
IST_HD PairSays cross_pair(const CornerView& pair, const exact::Point& aside,
                           PiercingEdge (&end)[2], double room = 0) {
  std::uint32_t above[2], unknown[2];
  IST_ROLLED
  for (int s = 1; s >= 0; --s) {
    std::uint32_t without = 0;
    const std::uint32_t bits = corners_above<kBy>(pair, s, aside, room, without);
    if (without == 0 && (bits == 0 || bits == 7)) return PairSays::apart;
    (s == 0 ? above[0] : above[1]) = bits;
    (s == 0 ? unknown[0] : unknown[1]) = without;
  }
  if ((unknown[0] | unknown[1]) != 0) return PairSays::unsure;
  const std::uint32_t through[2] = {edges_through(above[0]), edges_through(above[1])};
  return find_ends(above, through, ways_round<kBy>(pair, through, aside, room), end);
}

/// Calls work(lane, item) → bool for each item of which a lane `asks` a bit, by all lanes together:
/// what few lanes ask takes as long as what all do. Returns where it is true of this lane's.
template <int kItems, class Team, class Work>
IST_HD std::uint32_t ask_together(const Team& team, CornerMemory& memory, std::uint32_t asks,
                                  const Work& work) {
  if (!team.any(asks != 0)) return 0;
  std::uint32_t all = 0;
  IST_ROLLED
  for (int n = 0; n < kItems; ++n) {
    const std::uint32_t lanes = team.ballot((asks >> n & 1) != 0);
    if (team.lane() == 0) memory.asked[n] = lanes;
    all += static_cast<std::uint32_t>(count_bits(lanes));
  }
  team.sync();
  const auto lane = static_cast<std::uint32_t>(team.lane());
  std::uint32_t out = 0;
  for (std::uint32_t first = 0; first < all; first += static_cast<std::uint32_t>(Team::kWidth)) {
    bool yes = false;
    if (std::uint32_t k = first + lane; k < all) {
      int n = 0;
      std::uint32_t lanes = memory.asked[0];
      while (k >= static_cast<std::uint32_t>(count_bits(lanes))) {
        k -= static_cast<std::uint32_t>(count_bits(lanes));
        lanes = memory.asked[++n];
      }
      for (; k > 0; --k) lanes &= lanes - 1;
      yes = work(lowest_bit(lanes), n);
    }
    const std::uint32_t found = team.ballot(yes);
    std::uint32_t before = 0;
    IST_ROLLED
    for (int n = 0; n < kItems; ++n) {
      const std::uint32_t lanes = memory.asked[n];
      const std::uint32_t k =
          before + static_cast<std::uint32_t>(count_bits(lanes & ((1u << lane) - 1))) - first;
      if ((asks >> n & 1) != 0 && k < 32) out |= (found >> k & 1) << n;
      before += static_cast<std::uint32_t>(count_bits(lanes));
    }
  }
  team.sync();
  return out;
}

/// What exact signs say of the pair of each lane that `has` one.
template <class Team>
IST_HD PairSays cross_exactly(const Team& team, bool has, const CornerView& pair,
                              const exact::Point& aside, PiercingEdge (&end)[2]) {
  CornerMemory& memory = pair.memory;
  std::uint32_t above[2] = {0, 0};
  IST_ROLLED
  for (int s = 1; s >= 0; --s) {
    std::uint32_t unknown = 0;
    std::uint32_t bits = has ? corners_above<Signs::doubles>(pair, s, aside, 0, unknown) : 0;
    bits |= ask_together<3>(team, memory, unknown, [&](int lane, int k) {
      const CornerView of = {memory, lane};
      const exact::Point o = of.corner(1 - s, 0);
      std::uint32_t positive = 0, none = 0;
      of.keep(s, k,
              exact::exact_determinant(of.corner(s, k), o, of.corner(1 - s, 1), o,
                                       of.corner(1 - s, 2), o, s == 1 ? 1 : -1, aside),
              0, positive, none);
      return positive != 0;
    });
    has = has && bits != 0 && bits != 7;
    (s == 0 ? above[0] : above[1]) = bits;
  }
  const std::uint32_t through[2] = {edges_through(above[0]), edges_through(above[1])};
  WaysRound ways;
  if (has) ways = ways_round<Signs::doubles>(pair, through, aside, 0);
  ways.positive |= ask_together<9>(team, memory, ways.asked & ~ways.known, [&](int lane, int n) {
    const CornerView of = {memory, lane};
    const int i = n / 3, j = n % 3;
    const exact::Point p = of.corner(0, i), r = of.corner(1, j);
    return exact::exact_determinant(r, p, of.corner(0, (i + 1) % 3), p, of.corner(1, (j + 1) % 3),
                                    r, 1, aside)
               .sign > 0;
  });
  ways.known = ways.asked;
  return has ? find_ends(above, through, ways, end) : PairSays::apart;
}

}  // namespace ist::gpu
