#include "query/exact/crossing_search.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/exact/crossing_search.cpp"
#include <hwy/foreach_target.h>

#include "base/bits.h"
#include "query/exact/block_meeting-inl.h"
#include "query/exact/nearest_points.h"
#include "query/exact/pair_signs-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// The piercing edges of crossings, gathered until there are eight. Then all are written together,
/// without a branch on which edge of which triangle pierces.
class PiercingEdges {
 public:
  /// Adds the crossing of pair n. `pierced`: its piercing edges [A's, B's], exactly two if signs
  /// are consistent.
  HWY_INLINE void add(const TrianglePairs& pairs, const PairHeights& heights,
                      const std::uint32_t (&pierced)[2][3], std::uint32_t n) {
    // The piercing edges, and those at the crossing's end. An edge that goes down enters the other
    // solid: A's at the end, B's at the start.
    const std::uint32_t edges = bits_of(pierced[0], n) | bits_of(pierced[1], n) << 3,
                        ends = bits_of(heights.positive[0], n) |
                               (bits_of(heights.positive[1], n) ^ 7) << 3;
    const std::uint32_t of_end[2] = {edges & ~ends, edges & ends};
    for (int e = 0; e < 2; ++e) {
      const auto number = static_cast<std::uint32_t>(std::countr_zero(of_end[e] | 32u));
      const std::uint32_t s = number >= 3 ? 1 : 0, k = number - 3 * s, next = k == 2 ? 0 : k + 1;
      const auto put = [&](Number to, double value) { of_[e][to][count_] = value; };
      for (int x = 0; x < 3; ++x) {
        of_[e][kP + x][count_] = pairs.corner[s][k][x][n];
        of_[e][kQ + x][count_] = pairs.corner[s][next][x][n];
      }
      put(kHeightP, heights.value[s][k][n]);
      put(kHeightQ, heights.value[s][next][n]);
      put(kError, heights.error[s][k][n] + heights.error[s][next][n]);
      put(kShift, heights.shift[s][n]);
      put(kEdge, number);
    }
    for (int s = 0; s < 2; ++s) triangle_[s][count_] = pairs.triangle[s][n];
    ++count_;
  }
  bool full() const { return count_ == 8; }

  /// Writes the pending edges as the last of `end` crossings.
  void write(std::uint32_t end, Crossings& out) {
    const std::uint32_t at = end - count_;
    for (std::uint32_t i = 0; i < count_; ++i)
      for (int s = 0; s < 2; ++s) out.triangle(s, at + i) = triangle_[s][i];
    for (int e = 0; e < 2; ++e)
      for (std::uint32_t l = 0; l < count_; l += static_cast<std::uint32_t>(hn::Lanes(D())))
        write_end(e, l, at + l, out);
    count_ = 0;
  }

 private:
  enum Number {
    kP = 0,  ///< an edge from p to q
    kQ = 3,
    kHeightP = 6,
    kHeightQ,
    kError,
    kShift,
    kEdge,  ///< A's 0 … 2, B's 3 … 5
    kNumbers
  };

  static std::uint32_t bits_of(const std::uint32_t (&pairs)[3], std::uint32_t n) {
    return (pairs[0] >> n & 1) | (pairs[1] >> n & 1) << 1 | (pairs[2] >> n & 1) << 2;
  }
  HWY_INLINE void write_end(int e, std::uint32_t l, std::uint32_t at, Crossings& out) const {
    const D d;
    const auto load = [&](int number) { return hn::Load(d, of_[e][number] + l); };
    const auto point = [&](int number) -> Vec3 {
      return {load(number), load(number + 1), load(number + 2)};
    };
    const EdgeEnd end = edge_end(point(kP), point(kQ), load(kHeightP), load(kHeightQ));
    const auto put = [&](int number, V value) { hn::StoreU(value, d, out.end(e, number) + at); };
    const auto put_point = [&](int number, const Vec3& x) {
      put(number, x.x), put(number + 1, x.y), put(number + 2, x.z);
    };
    put_point(Crossings::kFrom, end.from);
    put_point(Crossings::kOffset, end.offset);
    const V one = hn::Set(d, 1.0), two = hn::Set(d, 2.0);
    put(Crossings::kT, hn::IfThenElse(end.from_second, one - end.share, end.share));
    // The order of two points on an edge is that with B translated symbolically.
    put(Crossings::kTError,
        hn::IfThenElse(
            end.flat, one,
            (two * (load(kError) + two * load(kShift))) / end.heights + hn::Set(d, 1e-15)));
    put(Crossings::kHeightError, load(kError));
    put(Crossings::kEdge,
        hn::IfThenElse(end.from_second, load(kEdge), load(kEdge) + hn::Set(d, 8.0)));
  }

  alignas(64) double of_[2][kNumbers][8] = {};  // unused lanes are computed too, and must be finite
  std::uint32_t triangle_[2][8];
  std::uint32_t count_ = 0;
};

/// Finds the crossing triangles in pairs of blocks.
class TriangleSearch : PairSigns {
 public:
  TriangleSearch(const CrossingSearch& search, ExactScratch& scratch)
      : PairSigns(search),
        a_(*search.a),
        b_(*search.b),
        scratch_(scratch),
        placed_(search, scratch),
        pad_b_(pad(search.a_from_b, b_)) {
    look_ahead(search.reach);
    scratch_.pairs->count = 0;
    scratch_.pairs->unmarked = 0;
  }

  CrossingsFound run(std::uint32_t first, std::uint32_t next, std::uint32_t count,
                     KeptPairs* keep) {
    keep_ = keep;
    found_.crossings = first;
    std::uint32_t n = next;
    for (; n < count && found_.complete; ++n) {
      // Two blocks add at most 256, and seven more may be pending.
      if (keep_ == nullptr && n > next && found_.crossings + 264 > scratch_.most_crossings) break;
      // If many more are near than cross, keeping them does not pay. Two blocks add at most 256.
      if (keep_ != nullptr && (gathered_ > 2 * n + 3 * keep->crossings + 512 ||
                               gathered_ + 264 > scratch_.kept.most())) {
        KeptRing::give_up(*keep);
        look_ahead(search_.near);
        test_kept(*keep);
      }
      meet(static_cast<std::uint32_t>(scratch_.keys[n] >> 32),
           static_cast<std::uint32_t>(scratch_.keys[n]));
    }
    if (keep_ != nullptr) test_kept(*keep);
    found_.next = n;
    return finish();
  }

  CrossingsFound run(const KeptPairs& kept) {
    test_kept(kept);
    return finish();
  }

 private:
  void look_ahead(float reach) {
    reach_ = reach;
    slack_ = 2 * pad_b_ + 2 * pad(Similarity::identity(), a_) + reach * 2;
  }

  void test_kept(const KeptPairs& kept) {
    if (keep_ != nullptr) keep_pairs();
    keep_ = nullptr;
    for (std::uint32_t n = 0; n < kept.count && found_.complete; ++n) {
      const std::uint64_t pair = scratch_.kept.pair(kept, n);
      const auto a = static_cast<std::uint32_t>(pair >> 32), b = static_cast<std::uint32_t>(pair);
      add_pair(a, placed_.vertices(false, a / kWidth), b, placed_.vertices(true, b / kWidth),
               !are_near(a / kWidth, b / kWidth));
    }
  }

  CrossingsFound finish() {
    if (found_.complete) test_pairs();
    ends_.write(found_.crossings, scratch_.crossings);
    // Sums process eight at a time.
    scratch_.crossings.clear(found_.crossings, (found_.crossings + 7) / 8 * 8);
    return found_;
  }

  /// Tests the triangles of two blocks by boxes and planes.
  void meet(std::uint32_t number_a, std::uint32_t number_b) {
    const PlacedTriangles& a = placed_.triangles(false, number_a);
    const PlacedTriangles& b = placed_.triangles(true, number_b);
    const OneBox all(b.all_low, b.all_high, reach_);
    std::uint32_t rows = meeting(a.low, a.high, all.low, all.high);
    if (rows == 0) return;
    const OneBox all_a(a.all_low, a.all_high, reach_);
    std::uint32_t in_a = meeting(b.low, b.high, all_a.low, all_a.high);
    if (in_a == 0) return;
    const BoxBlock& box_a = a_.level[1].boxes[number_a / kWidth];
    const PlacedBoxes& box_b =
        placed_boxes(b_, 1, number_b / kWidth, search_.a_from_b, pad_b_, *scratch_.placed_b);
    const std::uint32_t lane_a = number_a % kWidth, lane_b = number_b % kWidth;
    const float normal_a[3] = {box_a.normal[0][lane_a], box_a.normal[1][lane_a],
                               box_a.normal[2][lane_a]};
    const float normal_b[3] = {box_b.normal[0][lane_b], box_b.normal[1][lane_b],
                               box_b.normal[2][lane_b]};
    rows &= in_slab(a, normal_b, box_b.slab_low[lane_b] - slack_, box_b.slab_high[lane_b] + slack_);
    if (rows == 0) return;
    in_a &= in_slab(b, normal_a, box_a.slab_low[lane_a] - slack_, box_a.slab_high[lane_a] + slack_);
    if (in_a == 0) return;
    std::optional<Meeting>& made = made_;
    made.reset();
    const auto now = [&]() -> Meeting& {
      if (made) return *made;
      const Margin margin = keep_ != nullptr               ? Margin::reach
                            : are_near(number_a, number_b) ? Margin::rounding
                                                           : Margin::tolerance;
      return made.emplace(search_, scratch_, number_a, number_b, margin, reach_);
    };
    const auto thin = [&](const float* low, const float* high, std::uint32_t lane) {
      return high[lane] - low[lane] <= 2 * slack_;
    };
    const bool is_thin[2] = {thin(box_a.slab_low, box_a.slab_high, lane_a),
                             thin(box_b.slab_low, box_b.slab_high, lane_b)};
    // True if any triangles are left that the planes of a block do not separate.
    const auto straddle_blocks = [&] {
      for (int side = 0; side < 2; ++side) {
        if (!is_thin[side]) continue;
        const std::uint32_t left = now().straddling_block(side);
        (side == 0 ? in_a : rows) &= left;
      }
      return in_a != 0 && rows != 0;
    };
    if (!straddle_blocks()) return;
    bool flush = false, tried = false;
    while (rows != 0) {
      const auto i = static_cast<std::uint32_t>(std::countr_zero(rows));
      rows &= rows - 1;
      const OneBox box(a.low, a.high, i, reach_);
      std::uint32_t lanes = in_a & meeting(b.low, b.high, box.low, box.high);
      if (lanes == 0) continue;
      // Floats that decided nothing are not used again.
      const Straddling found = flush ? Straddling{0, lanes} : straddling(a, i, b, lanes, reach_);
      flush |= found.clear == 0 && found.doubtful != 0;
      if ((found.clear | found.doubtful) == 0) continue;
      Meeting& both = now();
      lanes = found.clear;
      if (found.doubtful != 0) lanes |= both.straddling(i, found.doubtful);
      if (lanes != 0) lanes = both.within_edges(i, lanes, edges_);
      if (lanes == 0) continue;
      for (const std::uint32_t k : set_bits(lanes))
        add_pair(kWidth * number_a + i, both.vertices(0), kWidth * number_b + k, both.vertices(1),
                 both.margin() == Margin::tolerance);
      // Once both blocks are marked, planes decide far more.
      if (!flush || both.margin() != Margin::tolerance) continue;
      const bool tries = !tried && marking_.pays();
      if (tries) test_pairs();
      tried |= tries;
      const bool marked = are_near(number_a, number_b);
      marking_.asked += tries;
      marking_.found += tries && marked;
      if (!marked) continue;
      made.reset();
      if (!straddle_blocks()) return;
    }
  }

  bool are_near(std::uint32_t block_a, std::uint32_t block_b) const {
    return has(scratch_.a.near, block_a) && has(scratch_.b.near, block_b);
  }

  /// `unmarked`: its blocks are not both marked as near.
  void add_pair(std::uint32_t triangle_a, const PlacedVertices& vertices_a,
                std::uint32_t triangle_b, const PlacedVertices& vertices_b, bool unmarked) {
    TrianglePairs& pairs = *scratch_.pairs;
    pairs.unmarked |= static_cast<std::uint32_t>(unmarked) << pairs.count;
    put_triangle(a_, triangle_a, vertices_a, 0, pairs);
    put_triangle(b_, triangle_b, vertices_b, 1, pairs);
    if (++pairs.count == 8) keep_ == nullptr ? test_pairs() : keep_pairs();
  }

  /// Tests the gathered pairs by the planes of both triangles and by edges.
  HWY_NOINLINE void test_pairs() {
    TrianglePairs& pairs = *scratch_.pairs;
    const std::uint32_t count = std::exchange(pairs.count, 0);
    const std::uint32_t unmarked = not_marked(pairs, std::exchange(pairs.unmarked, 0));
    const std::uint32_t all = (1u << count) - 1;
    if (count == 0 || !found_.complete) return;  // two blocks go on to their end
    PairHeights heights;
    EdgeOrientations round;
    unmarked != 0 ? find_heights<true>(pairs, count, heights)
                  : find_heights<false>(pairs, count, heights);
    const std::uint32_t certain = each(heights.certain[0]) & each(heights.certain[1]);
    for (const std::uint32_t i : set_bits(all & ~heights.apart(heights.certain) & ~certain))
      find_heights_exactly(pairs, i, heights);
    const std::uint32_t meet = all & ~heights.apart(heights.certain);
    if (meet != 0) {
      const auto lanes = static_cast<std::uint32_t>(std::bit_width(meet));
      unmarked != 0 ? find_orientations<true>(pairs, lanes, round)
                    : find_orientations<false>(pairs, lanes, round);
      test_edges(pairs, heights, meet, round);
    }
    if (unmarked != 0) note_near(pairs, not_marked(pairs, unmarked & ~settled(heights, round)));
  }

  /// Tests by edges the pairs that planes left.
  HWY_INLINE void test_edges(const TrianglePairs& pairs, const PairHeights& heights,
                             std::uint32_t all, EdgeOrientations& round) {
    std::uint32_t parts[2][3], pierced[2][3];
    heights.find_parts(parts);
    std::uint32_t left = round.undecided(all, parts, round.certain);
    if (left != 0) {
      refine_orientations(pairs, parts, left, round);
      left = round.undecided(left, parts, round.certain);
    }
    for (const std::uint32_t i : set_bits(left)) find_round_exactly(pairs, parts, i, round);
    round.pierced(parts, pierced);
    // Two edges pierce if triangles cross, else none.
    std::uint32_t once = 0, twice = 0, more = 0;
    for (const auto& of_side : pierced)
      for (const std::uint32_t bits : of_side) {
        more |= twice & bits & all;
        twice |= once & bits & all;
        once |= bits & all;
      }
    found_.consistent &= once == twice && more == 0;
    if (twice != 0) add_crossings(pairs, heights, pierced, twice);
  }

  /// The pairs whose blocks are not both marked as near.
  std::uint32_t not_marked(const TrianglePairs& pairs, std::uint32_t which) const {
    std::uint32_t out = 0;
    for (const std::uint32_t n : set_bits(which)) {
      const bool marked = are_near(pairs.triangle[0][n] / kWidth, pairs.triangle[1][n] / kWidth);
      out |= static_cast<std::uint32_t>(!marked) << n;
    }
    return out;
  }

  /// Marks the blocks of pairs whose signs might differ if points moved within the tolerance, if
  /// they are that near. So the marks do not depend on which search found the pairs. Crossing pairs
  /// have marked theirs.
  HWY_INLINE void note_near(const TrianglePairs& pairs, std::uint32_t fresh) {
    if (fresh == 0) return;
    // The first pair often marks the blocks of all others.
    mark_if_near(pairs, static_cast<std::uint32_t>(std::countr_zero(fresh)));
    fresh = not_marked(pairs, fresh & (fresh - 1));
    if (fresh == 0) return;
    fresh &= ~far_by_planes(pairs, static_cast<std::uint32_t>(std::bit_width(fresh)),
                            double{search_.near});
    for (const std::uint32_t n : set_bits(fresh))
      if (not_marked(pairs, 1u << n) != 0) mark_if_near(pairs, n);
  }

  void mark_if_near(const TrianglePairs& pairs, std::uint32_t n) {
    const ExactCorners corners(pairs, n);
    if (!exact::come_within(search_.near, corners.of[0], corners.of[1])) return;
    set(scratch_.a.near, pairs.triangle[0][n] / kWidth);
    set(scratch_.b.near, pairs.triangle[1][n] / kWidth);
  }

  /// Keeps the gathered pairs that no plane along a triangle, or along an edge of each, separates
  /// by more than the search's reach.
  void keep_pairs() {
    TrianglePairs& pairs = *scratch_.pairs;
    const std::uint32_t count = std::exchange(pairs.count, 0);
    pairs.unmarked = 0;
    gathered_ += count;
    for (const std::uint32_t n :
         set_bits(((1u << count) - 1) & ~apart_by_axes(pairs, count, double{reach_}))) {
      scratch_.kept.add(*keep_, std::uint64_t{pairs.triangle[0][n]} << 32 | pairs.triangle[1][n]);
    }
  }

  void add_crossings(const TrianglePairs& pairs, const PairHeights& heights,
                     const std::uint32_t (&pierced)[2][3], std::uint32_t crossing) {
    const auto added = static_cast<std::uint32_t>(std::popcount(crossing));
    if (found_.crossings + added > scratch_.most_crossings) {
      found_.complete = false;
      return;
    }
    for (const std::uint32_t n : set_bits(crossing)) {
      ends_.add(pairs, heights, pierced, n);
      ++found_.crossings;
      if (ends_.full()) ends_.write(found_.crossings, scratch_.crossings);
      set(scratch_.a.near, pairs.triangle[0][n] / kWidth);
      set(scratch_.b.near, pairs.triangle[1][n] / kWidth);
    }
  }

  const MeshTree& a_;
  const MeshTree& b_;
  ExactScratch& scratch_;
  PlacedMeshes placed_;
  float pad_b_, reach_, slack_;
  std::optional<Meeting> made_;  // a member, since GCC clears a local one
  EdgeTally edges_;
  Tally marking_;  ///< of tests at once, and of blocks that they marked
  PiercingEdges ends_;
  KeptPairs* keep_ = nullptr;   ///< near pairs are kept, and not tested yet
  std::uint32_t gathered_ = 0;  ///< pairs gathered for `keep_`
  CrossingsFound found_;
};

/// Tests whether crossing pairs cross however points move within the tolerance.
class SettledSearch : PairSigns {
 public:
  SettledSearch(const CrossingSearch& search, ExactScratch& scratch)
      : PairSigns(search), scratch_(scratch), placed_(search, scratch) {}

  bool any(std::uint32_t count) {
    TrianglePairs& pairs = *scratch_.pairs;
    for (std::uint32_t i = 0; i < count; i += pairs.count) {
      for (pairs.count = 0; pairs.count < 8 && i + pairs.count < count; ++pairs.count)
        for (int s = 0; s < 2; ++s) {
          const std::uint32_t triangle = scratch_.crossings.triangle(s, i + pairs.count);
          put_triangle(s == 0 ? *search_.a : *search_.b, triangle,
                       placed_.vertices(s == 1, triangle / kWidth), s, pairs);
        }
      if ((find_settled(pairs, pairs.count) & ((1u << pairs.count) - 1)) != 0) return true;
    }
    return false;
  }

 private:
  ExactScratch& scratch_;
  PlacedMeshes placed_;
};

bool search_settled(const CrossingSearch& search, std::uint32_t count, ExactScratch& scratch) {
  return SettledSearch(search, scratch).any(count);
}

CrossingsFound search_triangles(const CrossingSearch& search, std::uint32_t first,
                                std::uint32_t next, std::uint32_t count, KeptPairs* keep,
                                ExactScratch& scratch) {
  return TriangleSearch(search, scratch).run(first, next, count, keep);
}

CrossingsFound search_kept(const CrossingSearch& search, const KeptPairs& kept,
                           ExactScratch& scratch) {
  return TriangleSearch(search, scratch).run(kept);
}

const PlacedVertices& place_one(const CrossingSearch& search, bool of_b, std::uint32_t number,
                                ExactScratch& scratch) {
  return PlacedMeshes(search, scratch).vertices(of_b, number);
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(search_triangles);
HWY_EXPORT(search_kept);
HWY_EXPORT(search_settled);
HWY_EXPORT(place_one);

CrossingsFound find_crossings(const CrossingSearch& search, std::uint32_t first, std::uint32_t next,
                              std::uint32_t count, KeptPairs* keep,
                              ExactScratch& scratch) noexcept {
  return HWY_DYNAMIC_DISPATCH(search_triangles)(search, first, next, count, keep, scratch);
}

CrossingsFound find_kept_crossings(const CrossingSearch& search, const KeptPairs& kept,
                                   ExactScratch& scratch) noexcept {
  return HWY_DYNAMIC_DISPATCH(search_kept)(search, kept, scratch);
}

bool any_settled(const CrossingSearch& search, std::uint32_t count,
                 ExactScratch& scratch) noexcept {
  return HWY_DYNAMIC_DISPATCH(search_settled)(search, count, scratch);
}

const PlacedVertices& place_block(const CrossingSearch& search, bool of_b, std::uint32_t number,
                                  ExactScratch& scratch) noexcept {
  return HWY_DYNAMIC_DISPATCH(place_one)(search, of_b, number, scratch);
}

}  // namespace ist
#endif
