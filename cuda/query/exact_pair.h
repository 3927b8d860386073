#pragma once

#include <cstdint>

#include "base/bits.h"
#include "query/exact/orientation.h"
#include "query/exact/overlap_formulas.h"

// Tests of a pair of triangles, each by a single lane.

namespace ist::gpu {

enum class Signs {
  doubles,
  settled,  ///< doubles that stay the same wherever points move within the tolerance
};

enum class PairSays : std::uint32_t {
  apart,
  crosses,
  unsure,  ///< the signs do not decide
  wrong,   ///< signs are inconsistent
};

/// Arrays that lanes index differently. As local arrays they would be in slow memory.
struct CornerMemory {
  double x[2][3][3][32];                    ///< A's, B's; of a corner
  double value[2][3][32], error[2][3][32];  ///< heights above the other's plane
  std::uint32_t wanted[9];                  ///< exact signs that lanes need, a bit for each lane
};

/// A lane's part of CornerMemory.
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
  /// Stores a corner's height, and sets a bit if the corner is above, or if its sign is unknown.
  IST_HD void keep(int s, int k, const exact::Determinant& height, int bit, std::uint32_t& above,
                   std::uint32_t& unknown) const {
    memory.value[s][k][lane] = height.value;
    // If the symbolic translation decides, the plane may be on the other side of the corner.
    memory.error[s][k][lane] =
        height.error + (height.value * height.sign < 0 ? std::abs(height.value) : 0);
    above |= (height.sign > 0 ? 1u : 0u) << bit;
    unknown |= (height.sign == 0 ? 1u : 0u) << bit;
  }
};

/// An edge that crosses the other triangle. Edge k leads from corner k to the next.
struct PiercingEdge {
  std::uint32_t of_b, edge;
};

IST_HD inline double largest(const exact::Point& x) {
  return std::fmax(std::abs(x.x), std::fmax(std::abs(x.y), std::abs(x.z)));
}
/// A bound of the change of r's height if points move within the tolerance: six products of three
/// numbers.
IST_HD inline double moved_height(double tolerance, double longest, const exact::Point& r) {
  return 6 * tolerance * longest * (2 * largest(r) + longest);
}

/// The corners of a side above the other's triangle, a bit each, and those that are `unknown`.
template <Signs kBy>
IST_HD std::uint32_t corners_above(const CornerView& pair, int s, const exact::Point& aside,
                                   double tolerance, std::uint32_t& unknown) {
  const exact::Point o = pair.corner(1 - s, 0), p = pair.corner(1 - s, 1) - o,
                     q = pair.corner(1 - s, 2) - o;
  const exact::FilteredPlane plane(p, q, (s == 1 ? 1 : -1) * aside);
  const double longest = std::fmax(largest(p), largest(q)) + tolerance;
  std::uint32_t bits = 0;
  unknown = 0;
  // Loops stay rolled, since rare code must not fill the instruction cache.
  IST_ROLLED
  for (int k = 0; k < 3; ++k) {
    const exact::Point r = pair.corner(s, k) - o;
    pair.keep(s, k,
              kBy == Signs::settled ? plane.height(r, moved_height(tolerance, longest, r))
                                    : plane.height(r),
              k, bits, unknown);
  }
  return bits;
}

/// The edges that cross the other's plane, a bit each.
IST_HD inline std::uint32_t edges_through(std::uint32_t above) {
  return above ^ (above >> 1 | (above & 1) << 2);
}

/// The signs of the volumes spanned by an edge of A and one of B, at bit 3 · A's + B's.
struct EdgeOrientations {
  std::uint32_t wanted = 0, known = 0, positive = 0;
};
/// Computes the signs for edges that cross the other's plane.
template <Signs kBy>
IST_HD EdgeOrientations edge_orientations(const CornerView& pair, const std::uint32_t (&through)[2],
                                          const exact::Point& aside, double tolerance) {
  EdgeOrientations orientations;
  IST_ROLLED
  for (int n = 0; n < 9; ++n) {
    const int i = n / 3, j = n % 3;
    if (((through[0] >> i | through[1] >> j) & 1) == 0) continue;
    const exact::Point p = pair.corner(0, i), r = pair.corner(1, j), between = r - p;
    const exact::Point u = pair.corner(0, (i + 1) % 3) - p, v = pair.corner(1, (j + 1) % 3) - r;
    double moved = 0;
    if constexpr (kBy == Signs::settled) {
      const double of_a = largest(u) + tolerance, of_b = largest(v) + tolerance,
                   size = largest(between + aside);
      moved = 6 * tolerance * (of_a * of_b + size * (of_a + of_b));
    }
    const int sign = exact::FilteredPlane(u, v, aside).height(between, moved).sign;
    orientations.wanted |= 1u << n;
    orientations.known |= (sign != 0 ? 1u : 0u) << n;
    orientations.positive |= (sign > 0 ? 1u : 0u) << n;
  }
  return orientations;
}

/// If the triangles cross, finds the edges at the start and end of their common segment: A's edge
/// leaves B at the start and enters it at the end, B's edge enters A at the start. `above`: for A's
/// corners and B's.
IST_HD inline PairSays find_ends(const std::uint32_t (&above)[2], const std::uint32_t (&through)[2],
                                 const EdgeOrientations& orientations, PiercingEdge (&end)[2]) {
  int count[2] = {0, 0};
  IST_ROLLED
  for (std::uint32_t n = 0; n < 6; ++n) {
    const std::uint32_t s = n / 3, k = n % 3;
    const std::uint32_t all = s == 0 ? 7u << 3 * k : 0b1001001u << k,
                        bits = orientations.positive & all;
    // Two different signs prove that the edge misses the triangle, whatever the third is.
    if (((s == 0 ? through[0] : through[1]) >> k & 1) == 0 ||
        (bits != 0 && bits != (orientations.known & all)))
      continue;
    if ((orientations.known & all) != all) return PairSays::unsure;
    const bool down = ((s == 0 ? above[0] : above[1]) >> k & 1) != 0;  // enters the other solid
    const bool at_end = down == (s == 0);
    ++(at_end ? count[1] : count[0]);
    (at_end ? end[1] : end[0]) = {s, k};
  }
  if (count[0] == 0 && count[1] == 0) return PairSays::apart;
  return count[0] == 1 && count[1] == 1 ? PairSays::crosses : PairSays::wrong;
}

/// Decides a lane's pair by doubles.
template <Signs kBy>
IST_HD PairSays cross_pair(const CornerView& pair, const exact::Point& aside,
                           PiercingEdge (&end)[2], double tolerance = 0) {
  std::uint32_t above[2], unknown[2];
  IST_ROLLED
  for (int s = 1; s >= 0; --s) {
    std::uint32_t without = 0;
    const std::uint32_t bits = corners_above<kBy>(pair, s, aside, tolerance, without);
    if (without == 0 && (bits == 0 || bits == 7)) return PairSays::apart;
    (s == 0 ? above[0] : above[1]) = bits;
    (s == 0 ? unknown[0] : unknown[1]) = without;
  }
  if ((unknown[0] | unknown[1]) != 0) return PairSays::unsure;
  const std::uint32_t through[2] = {edges_through(above[0]), edges_through(above[1])};
  return find_ends(above, through, edge_orientations<kBy>(pair, through, aside, tolerance), end);
}

/// Calls work(lane, item) → bool for each item whose bit is set in a lane's `wanted`. All lanes
/// share these calls, since a few calls by single lanes take as long as many. Returns this lane's
/// results.
template <int kItems, class Team, class Work>
IST_HD std::uint32_t ask_together(const Team& team, CornerMemory& memory, std::uint32_t wanted,
                                  const Work& work) {
  if (!team.any(wanted != 0)) return 0;
  std::uint32_t all = 0;
  IST_ROLLED
  for (int n = 0; n < kItems; ++n) {
    const std::uint32_t lanes = team.ballot((wanted >> n & 1) != 0);
    if (team.lane() == 0) memory.wanted[n] = lanes;
    all += static_cast<std::uint32_t>(count_bits(lanes));
  }
  team.sync();
  const auto lane = static_cast<std::uint32_t>(team.lane());
  std::uint32_t out = 0;
  for (std::uint32_t first = 0; first < all; first += static_cast<std::uint32_t>(Team::kWidth)) {
    bool yes = false;
    if (std::uint32_t k = first + lane; k < all) {
      int n = 0;
      std::uint32_t lanes = memory.wanted[0];
      while (k >= static_cast<std::uint32_t>(count_bits(lanes))) {
        k -= static_cast<std::uint32_t>(count_bits(lanes));
        lanes = memory.wanted[++n];
      }
      for (; k > 0; --k) lanes &= lanes - 1;
      yes = work(lowest_bit(lanes), n);
    }
    const std::uint32_t found = team.ballot(yes);
    std::uint32_t before = 0;
    IST_ROLLED
    for (int n = 0; n < kItems; ++n) {
      const std::uint32_t lanes = memory.wanted[n];
      const std::uint32_t k =
          before + static_cast<std::uint32_t>(count_bits(lanes & ((1u << lane) - 1))) - first;
      if ((wanted >> n & 1) != 0 && k < 32) out |= (found >> k & 1) << n;
      before += static_cast<std::uint32_t>(count_bits(lanes));
    }
  }
  team.sync();
  return out;
}

/// Decides by exact signs the pair of each lane that `has` one.
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
  EdgeOrientations orientations;
  if (has) orientations = edge_orientations<Signs::doubles>(pair, through, aside, 0);
  orientations.positive |= ask_together<9>(
      team, memory, orientations.wanted & ~orientations.known, [&](int lane, int n) {
        const CornerView of = {memory, lane};
        const int i = n / 3, j = n % 3;
        const exact::Point p = of.corner(0, i), r = of.corner(1, j);
        return exact::exact_determinant(r, p, of.corner(0, (i + 1) % 3), p,
                                        of.corner(1, (j + 1) % 3), r, 1, aside)
                   .sign > 0;
      });
  orientations.known = orientations.wanted;
  return has ? find_ends(above, through, orientations, end) : PairSays::apart;
}

}  // namespace ist::gpu
