#include "query/exact/crossing_search.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/exact/crossing_search.cpp"
#include <hwy/foreach_target.h>

#include "query/exact/crossing_ends-inl.h"
#include "query/exact/nearest_points.h"
#include "query/exact/pair_signs-inl.h"
#include "query/exact/placed_mesh-inl.h"
#include "query/exact/plane_sides-inl.h"
#include "query/exact/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// Finds the triangles that cross in pairs of blocks.
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
    scratch_.pairs->asks = 0;
  }

  CrossingsFound run(std::uint32_t first, std::uint32_t next, std::uint32_t count,
                     KeptPairs* keep) {
    keep_ = keep;
    found_.crossings = first;
    std::uint32_t n = next;
    for (; n < count && found_.complete; ++n) {
      // Two blocks add at most 256, and seven more wait.
      if (keep_ == nullptr && n > next && found_.crossings + 264 > scratch_.most_crossings) break;
      // Where many more are near than cross, keeping them would not pay. Two blocks add at most
      // 256.
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

  SurfaceContact contact(std::uint32_t count, const KeptPairs* kept) {
    look_ahead(search_.near);
    SurfaceContact out;
    TrianglePairs& pairs = *scratch_.pairs;
    const auto add_areas = [&] {
      alignas(64) double area[8], along[3][8], moment[3][8];
      find_areas(pairs, area, along, moment);
      for (std::uint32_t n = 0; n < pairs.count; ++n) {
        out.area += area[n];
        out.normal = out.normal + exact::Point{along[0][n], along[1][n], along[2][n]};
        out.moment = out.moment + exact::Point{moment[0][n], moment[1][n], moment[2][n]};
      }
      pairs.count = 0;
    };
    std::optional<Meeting> now;
    std::uint64_t blocks = ~std::uint64_t{0};
    visit_near(
        count, kept,
        [&](std::uint32_t number_a, std::uint32_t i, std::uint32_t number_b, std::uint32_t lanes) {
          lanes &= facing(placed_.triangles(false, number_a), i, placed_.triangles(true, number_b));
          if (lanes == 0) return false;
          const std::uint64_t met = std::uint64_t{number_a} << 32 | number_b;
          if (std::exchange(blocks, met) != met) now.emplace(*this, number_a, number_b);
          for (lanes = now->flush(i, lanes); lanes != 0; lanes &= lanes - 1) {
            const auto j = static_cast<std::uint32_t>(std::countr_zero(lanes));
            put_pair(kWidth * number_a + i, *now->vertices[0], kWidth * number_b + j,
                     *now->vertices[1]);
            if (pairs.count == 8) add_areas();
          }
          return false;
        });
    add_areas();
    out.touching = out.area > 0;
    if (!out.touching)  // in a point or an edge, if at all
      visit_near(
          count, kept,
          [&](std::uint32_t number_a, std::uint32_t i, std::uint32_t number_b,
              std::uint32_t lanes) {
            for (; lanes != 0 && !out.touching; lanes &= lanes - 1)
              out.touching = exact::come_within(
                  search_.touch, corners(false, number_a, i).of,
                  corners(true, number_b, static_cast<std::uint32_t>(std::countr_zero(lanes))).of);
            return out.touching;
          });
    return out;
  }

 private:
  struct Corners {
    exact::Point of[3];
  };
  Corners corners(bool of_b, std::uint32_t number, std::uint32_t t) {
    const MeshBlock& block = (of_b ? b_ : a_).blocks[number];
    const PlacedVertices& vertices = placed_.vertices(of_b, number);
    Corners out;
    for (int c = 0; c < 3; ++c) {
      const std::uint32_t v = block.corner[c][t];
      out.of[c] = {vertices.at[0][v], vertices.at[1][v], vertices.at[2][v]};
    }
    return out;
  }

  /// visit(A's block, its triangle, B's block, some of its triangles): until it returns true, of
  /// blocks that are marked as near, or of pairs that are kept, those whose boxes meet.
  template <class Visit>
  void visit_near(std::uint32_t count, const KeptPairs* kept, const Visit& visit) {
    for (std::uint32_t n = 0; n < (kept != nullptr ? kept->count : count); ++n) {
      const std::uint64_t pair = kept != nullptr ? scratch_.kept.pair(*kept, n) : scratch_.keys[n];
      const auto a = static_cast<std::uint32_t>(pair >> 32), b = static_cast<std::uint32_t>(pair);
      if (kept != nullptr) {
        if (are_near(a / kWidth, b / kWidth) &&
            visit(a / kWidth, a % kWidth, b / kWidth, 1u << b % kWidth))
          return;
        continue;
      }
      if (!are_near(a, b)) continue;
      const PlacedTriangles &of_a = placed_.triangles(false, a), &of_b = placed_.triangles(true, b);
      for (std::uint32_t i = 0; i < a_.blocks[a].triangles; ++i) {
        const OneBox box(of_a.low, of_a.high, i, reach_);
        const std::uint32_t lanes = meeting(of_b.low, of_b.high, box.low, box.high);
        if (lanes != 0 && visit(a, i, b, lanes)) return;
      }
    }
  }

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
    // Sums go over eight at a time.
    scratch_.crossings.clear(found_.crossings, (found_.crossings + 7) / 8 * 8);
    return found_;
  }

  /// Which of B's triangles may look straight at A's triangle i. In float: sums of a normal's
  /// coordinates are no more than 1.8 times its length.
  static std::uint32_t facing(const PlacedTriangles& a, std::uint32_t i, const PlacedTriangles& b) {
    const F d;
    const auto length_a = hn::Set(d, a.length[i]), slack_a = hn::Set(d, a.slack[i]);
    std::uint32_t bits = 0;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      const auto length_b = hn::Load(d, b.length + l), slack_b = hn::Load(d, b.slack + l);
      const auto along = (hn::Set(d, a.normal[0][i]) * hn::Load(d, b.normal[0] + l) +
                          hn::Set(d, a.normal[1][i]) * hn::Load(d, b.normal[1] + l)) +
                         hn::Set(d, a.normal[2][i]) * hn::Load(d, b.normal[2] + l);
      const auto off = hn::Set(d, 2.0f) * (slack_a * length_b + slack_b * length_a) +
                       hn::Set(d, 3.0f) * slack_a * slack_b;
      bits |= mask_bits(d, along <= off - hn::Set(d, 0.3f) * length_a * length_b) << l;
    }
    return bits;
  }

  /// Which triangles of a block reach into a slab.
  static std::uint32_t in_slab(const PlacedTriangles& triangles, const float (&normal)[3],
                               float low, float high) {
    const F d;
    std::uint32_t bits = 0;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      hn::Vec<F> along[3];
      for (int c = 0; c < 3; ++c)
        along[c] = (hn::Set(d, normal[0]) * hn::Load(d, triangles.corner[c][0] + l) +
                    hn::Set(d, normal[1]) * hn::Load(d, triangles.corner[c][1] + l)) +
                   hn::Set(d, normal[2]) * hn::Load(d, triangles.corner[c][2] + l);
      bits |=
          mask_bits(d, hn::And(hn::Min(along[0], hn::Min(along[1], along[2])) <= hn::Set(d, high),
                               hn::Max(along[0], hn::Max(along[1], along[2])) >= hn::Set(d, low)))
          << l;
    }
    return bits;
  }

  /// Triangles of B that reach through the plane of one of A's, which reaches through theirs.
  struct Straddling {
    std::uint32_t clear = 0, doubtful = 0;
  };

  /// In float.
  HWY_INLINE Straddling straddling(const PlacedTriangles& a, std::uint32_t i,
                                   const PlacedTriangles& b, std::uint32_t lanes) const {
    const F d;
    // Coordinates are floats, and points of both blocks that matter are no further apart than this.
    const float blur = 1e-6f * (a.reach + b.reach) + reach_, size = a.size + b.size;
    const auto over_a = hn::Set(d, blur * a.length[i] + a.slack[i] * size);
    Straddling out;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      if ((lanes >> l & ((1u << hn::Lanes(d)) - 1)) == 0) continue;
      const auto over_b = hn::Set(d, blur) * hn::Load(d, b.length + l) +
                          hn::Load(d, b.slack + l) * hn::Set(d, size);
      hn::Vec<F> of_b[3], of_a[3];
      for (int c = 0; c < 3; ++c) {
        of_b[c] = ((hn::Set(d, a.normal[0][i]) * hn::Load(d, b.corner[c][0] + l) +
                    hn::Set(d, a.normal[1][i]) * hn::Load(d, b.corner[c][1] + l)) +
                   hn::Set(d, a.normal[2][i]) * hn::Load(d, b.corner[c][2] + l)) -
                  hn::Set(d, a.offset[i]);
        of_a[c] = ((hn::Load(d, b.normal[0] + l) * hn::Set(d, a.corner[c][0][i]) +
                    hn::Load(d, b.normal[1] + l) * hn::Set(d, a.corner[c][1][i])) +
                   hn::Load(d, b.normal[2] + l) * hn::Set(d, a.corner[c][2][i])) -
                  hn::Load(d, b.offset + l);
      }
      // How far the heights reach to the nearer side of a plane.
      const auto through = [](const hn::Vec<F>(&height)[3]) {
        return hn::Min(hn::Neg(hn::Min(height[0], hn::Min(height[1], height[2]))),
                       hn::Max(height[0], hn::Max(height[1], height[2])));
      };
      const auto a_by = through(of_b), b_by = through(of_a);
      const std::uint32_t may =
          mask_bits(d, hn::And(a_by >= hn::Neg(over_a), b_by >= hn::Neg(over_b)));
      const std::uint32_t clear = mask_bits(d, hn::And(a_by > over_a, b_by > over_b));
      out.clear |= clear << l;
      out.doubtful |= (may & ~clear) << l;
    }
    out.clear &= lanes;
    out.doubtful &= lanes;
    return out;
  }

  /// Tests the triangles of two blocks by boxes and planes.
  void meet(std::uint32_t number_a, std::uint32_t number_b) {
    const PlacedTriangles& a = placed_.triangles(false, number_a);
    const PlacedTriangles& b = placed_.triangles(true, number_b);
    const OneBox all(b.all_low, b.all_high, reach_);
    std::uint32_t rows = meeting(a.low, a.high, all.low, all.high);
    const BoxBlock& box_a = a_.level[1].boxes[number_a / kWidth];
    const PlacedBoxes& box_b =
        placed_boxes(b_, 1, number_b / kWidth, search_.a_from_b, pad_b_, *scratch_.placed_b);
    const std::uint32_t lane_a = number_a % kWidth, lane_b = number_b % kWidth;
    const float normal_a[3] = {box_a.normal[0][lane_a], box_a.normal[1][lane_a],
                               box_a.normal[2][lane_a]};
    const float normal_b[3] = {box_b.normal[0][lane_b], box_b.normal[1][lane_b],
                               box_b.normal[2][lane_b]};
    if (rows != 0)
      rows &=
          in_slab(a, normal_b, box_b.slab_low[lane_b] - slack_, box_b.slab_high[lane_b] + slack_);
    if (rows == 0) return;
    const std::uint32_t in_a =
        in_slab(b, normal_a, box_a.slab_low[lane_a] - slack_, box_a.slab_high[lane_a] + slack_);
    if (in_a == 0) return;
    std::optional<Meeting> made;
    const auto now = [&]() -> Meeting& {
      return made ? *made : made.emplace(*this, number_a, number_b);
    };
    const auto thin = [&](const float* low, const float* high, std::uint32_t lane) {
      return high[lane] - low[lane] <= 2 * slack_;
    };
    if ((thin(box_a.slab_low, box_a.slab_high, lane_a) && now().beside(false)) ||
        (thin(box_b.slab_low, box_b.slab_high, lane_b) && now().beside(true)))
      return;
    bool flush = false;
    for (; rows != 0; rows &= rows - 1) {
      const auto i = static_cast<std::uint32_t>(std::countr_zero(rows));
      const OneBox box(a.low, a.high, i, reach_);
      std::uint32_t lanes = in_a & meeting(b.low, b.high, box.low, box.high);
      if (lanes != 0) {
        // Where floats tell nothing, they are not asked again.
        const Straddling found = flush ? Straddling{0, lanes} : straddling(a, i, b, lanes);
        flush |= found.clear == 0 && found.doubtful != 0;
        lanes = found.clear;
        if (found.doubtful != 0) lanes |= now().straddling(i, found.doubtful);
      }
      for (; lanes != 0; lanes &= lanes - 1)
        add_pair(kWidth * number_a + i, *now().vertices[0],
                 kWidth * number_b + static_cast<std::uint32_t>(std::countr_zero(lanes)),
                 *now().vertices[1], !now().near);
    }
  }

  /// Two blocks whose triangles are tested by the planes of either side, in double. Where a sign is
  /// not settled, a plane does not keep them apart unless both blocks are marked as near anyway.
  class Meeting {
   public:
    Meeting(TriangleSearch& all, std::uint32_t a, std::uint32_t b)
        : vertices{&all.placed_.vertices(false, a), &all.placed_.vertices(true, b)},
          near(all.are_near(a, b)),
          all_(all),
          number_{a, b} {
      margin_ = all.keep_ != nullptr ? Margin::reach : near ? Margin::rounding : Margin::room;
      by_ = all.keep_ != nullptr ? double{all.reach_} : double{all.search_.room};
      const PlacedTriangles &of_a = all.placed_.triangles(false, a),
                            &of_b = all.placed_.triangles(true, b);
      for (int k = 0; k < 3; ++k)
        apart_ = std::max(apart_, std::max(of_a.all_high[k], of_b.all_high[k]) -
                                      std::min(of_a.all_low[k], of_b.all_low[k]));
      apart_ += all.search_.room;
    }

    const PlacedVertices* const vertices[2];
    const bool near;  ///< both are marked

    /// Whether the planes of A's or B's block lie beside the other block as a whole.
    bool beside(bool of_b) {
      // Its own heights are off by as much as the other's.
      const PlacedPlanes& planes = planes_of(of_b);
      const double off = 1.1 * exact::kFilter * planes.size[planes.widest] * apart_;
      const PlaneSides found = sides(of_b, planes.widest, planes.low - off, planes.high + off);
      constexpr std::uint32_t kAll = (1u << kWidth) - 1;
      return found.above == kAll || found.below == kAll;
    }

    /// Which of `lanes` of B no plane keeps apart from A's triangle i.
    std::uint32_t straddling(std::uint32_t i, std::uint32_t lanes) {
      const MeshBlock &a = all_.a_.blocks[number_[0]], &b = all_.b_.blocks[number_[1]];
      lanes &= ~kept_apart(sides(false, i, 0, 0), b);
      for (std::uint32_t left = lanes; left != 0; left &= left - 1) {
        const auto j = static_cast<std::uint32_t>(std::countr_zero(left));
        if ((known_ >> j & 1) == 0) {
          known_ |= 1u << j;
          columns_[j] = kept_apart(sides(true, j, 0, 0), a);
        }
        lanes &= ~((columns_[j] >> i & 1) << j);
      }
      return lanes;
    }

    /// Which of `lanes` of B lie in the plane of A's triangle i, to CrossingSearch::touch.
    std::uint32_t flush(std::uint32_t i, std::uint32_t lanes) {
      const PlacedPlanes& planes = planes_of(false);
      const exact::Point n = {planes.normal[0][i], planes.normal[1][i], planes.normal[2][i]};
      const double far = all_.search_.touch * std::sqrt(dot(n, n));
      const PlaneSides off = sides_of(*vertices[1], planes, i, -far, far, {0, 0, 0}, double{apart_},
                                      Margin::rounding, 0);
      return lanes & triangles_of(~(off.above | off.below), all_.b_.blocks[number_[1]]);
    }

   private:
    const PlacedPlanes& planes_of(bool of_b) {
      return of_b ? placed_planes(all_.b_, number_[1], &all_.search_.a_from_b,
                                  *all_.scratch_.placed_b)
                  : placed_planes(all_.a_, number_[0], nullptr, *all_.scratch_.placed_a);
    }
    /// Of the other block's vertices.
    PlaneSides sides(bool of_b, std::uint32_t t, double low, double high) {
      return sides_of(*vertices[of_b ? 0 : 1], planes_of(of_b), t, low, high,
                      (of_b ? -1.0 : 1.0) * all_.search_.aside, double{apart_}, margin_, by_);
    }
    static std::uint32_t kept_apart(const PlaneSides& sides, const MeshBlock& block) {
      return triangles_of(sides.above, block) | triangles_of(sides.below, block);
    }

    TriangleSearch& all_;
    std::uint32_t number_[2];
    Margin margin_;
    double by_;
    float apart_ = 0;                ///< no coordinates of both blocks differ by more
    std::uint32_t columns_[kWidth];  ///< A's triangles that B's plane keeps apart, a bit each
    std::uint32_t known_ = 0;
  };

  bool are_near(std::uint32_t block_a, std::uint32_t block_b) const {
    return has(scratch_.a.near, block_a) && has(scratch_.b.near, block_b);
  }

  /// `asks`: its blocks are not both marked as near.
  void add_pair(std::uint32_t triangle_a, const PlacedVertices& vertices_a,
                std::uint32_t triangle_b, const PlacedVertices& vertices_b, bool asks) {
    TrianglePairs& pairs = *scratch_.pairs;
    pairs.asks |= static_cast<std::uint32_t>(asks) << pairs.count;
    put_pair(triangle_a, vertices_a, triangle_b, vertices_b);
    if (pairs.count == 8) keep_ == nullptr ? test_pairs() : keep_pairs();
  }

  void put_pair(std::uint32_t triangle_a, const PlacedVertices& vertices_a,
                std::uint32_t triangle_b, const PlacedVertices& vertices_b) {
    TrianglePairs& pairs = *scratch_.pairs;
    const std::uint32_t n = pairs.count++;
    const auto take = [&](int side, const MeshTree& mesh, std::uint32_t triangle,
                          const PlacedVertices& from) {
      const MeshBlock& block = mesh.blocks[triangle / kWidth];
      for (int c = 0; c < 3; ++c) {
        const std::uint32_t v = block.corner[c][triangle % kWidth];
        for (int k = 0; k < 3; ++k) pairs.corner[side][c][k][n] = from.at[k][v];
      }
      pairs.triangle[side][n] = triangle;
    };
    take(0, a_, triangle_a, vertices_a);
    take(1, b_, triangle_b, vertices_b);
  }

  /// Tests what has been gathered, by the planes of both triangles and by edges.
  HWY_NOINLINE void test_pairs() {
    TrianglePairs& pairs = *scratch_.pairs;
    const std::uint32_t count = std::exchange(pairs.count, 0), asks = std::exchange(pairs.asks, 0);
    const std::uint32_t all = (1u << count) - 1;
    if (count == 0 || !found_.complete) return;  // two blocks go on to their end
    PairHeights heights;
    find_heights<false>(pairs, count, heights);
    const std::uint32_t certain = each(heights.certain[0]) & each(heights.certain[1]);
    for (std::uint32_t left = all & ~heights.apart(heights.certain) & ~certain; left != 0;
         left &= left - 1)
      find_heights_exactly(pairs, static_cast<std::uint32_t>(std::countr_zero(left)), heights);
    const std::uint32_t meet = all & ~heights.apart(heights.certain);
    note_near(pairs, count, asks, meet != 0 ? test_edges(pairs, heights, meet) : 0);
  }

  /// Tests by edges the pairs that planes left. Returns those that cross.
  HWY_INLINE std::uint32_t test_edges(const TrianglePairs& pairs, const PairHeights& heights,
                                      std::uint32_t all) {
    WaysRound round;
    find_ways_round<false>(pairs, static_cast<std::uint32_t>(std::bit_width(all)), round);
    std::uint32_t parts[2][3], pierced[2][3];
    heights.find_parts(parts);
    for (std::uint32_t left = all & ~round.decided(parts, round.certain); left != 0;
         left &= left - 1)
      find_round_exactly(pairs, parts, static_cast<std::uint32_t>(std::countr_zero(left)), round);
    round.may_pierce(parts, round.certain, pierced);
    // Two edges pierce where triangles cross, none else.
    std::uint32_t once = 0, twice = 0, more = 0;
    for (const auto& of_side : pierced)
      for (const std::uint32_t bits : of_side) {
        more |= twice & bits & all;
        twice |= once & bits & all;
        once |= bits & all;
      }
    found_.consistent &= once == twice && more == 0;
    if (twice != 0) add_crossings(pairs, heights, pierced, twice);
    return twice;
  }

  /// Those whose blocks are not both marked as near.
  std::uint32_t not_marked(const TrianglePairs& pairs, std::uint32_t which) const {
    std::uint32_t out = 0;
    for (; which != 0; which &= which - 1) {
      const int n = std::countr_zero(which);
      const bool marked = are_near(pairs.triangle[0][n] / kWidth, pairs.triangle[1][n] / kWidth);
      out |= static_cast<std::uint32_t>(!marked) << n;
    }
    return out;
  }

  /// Pairs whose signs might be others if points moved by the room mark their blocks, if they are
  /// as near: the same ones whichever search found them. Those that cross have marked theirs.
  HWY_INLINE void note_near(const TrianglePairs& pairs, std::uint32_t count, std::uint32_t asks,
                            std::uint32_t crossing) {
    asks = not_marked(pairs, asks);
    if (found_.settled) crossing = 0;
    if ((asks | crossing) == 0) return;
    const std::uint32_t settled = find_settled(pairs, count);
    found_.settled |= (crossing & settled) != 0;
    std::uint32_t fresh = asks & ~settled;
    if (fresh == 0) return;
    fresh &= ~far_by_planes(pairs, static_cast<std::uint32_t>(std::bit_width(fresh)),
                            double{search_.near});
    for (; fresh != 0; fresh &= fresh - 1) {
      const auto n = static_cast<std::uint32_t>(std::countr_zero(fresh));
      const ExactCorners corners(pairs, n);
      if (not_marked(pairs, 1u << n) == 0 ||
          !exact::come_within(search_.near, corners.of[0], corners.of[1]))
        continue;
      set(scratch_.a.near, pairs.triangle[0][n] / kWidth);
      set(scratch_.b.near, pairs.triangle[1][n] / kWidth);
    }
  }

  /// Keeps of what has been gathered what no plane along a triangle or along an edge of each keeps
  /// as far apart as the search reaches.
  HWY_NOINLINE void keep_pairs() {
    const D d;
    const TrianglePairs& pairs = *scratch_.pairs;
    const std::uint32_t count = pairs.count;
    scratch_.pairs->count = 0;
    scratch_.pairs->asks = 0;
    gathered_ += count;
    std::uint32_t apart = 0;
    for (std::size_t l = 0; l < count; l += hn::Lanes(d)) {
      Vec3 corner[2][3], edge[2][3], normal[2];
      for (int s = 0; s < 2; ++s) {
        for (int c = 0; c < 3; ++c) corner[s][c] = corner_of(pairs, s, c, l);
        for (int c = 0; c < 3; ++c) edge[s][c] = corner[s][(c + 1) % 3] - corner[s][c];
        normal[s] = cross(edge[s][0], edge[s][1]);
      }
      const V zero = hn::Zero(d), reach = hn::Set(d, double{reach_});
      V beyond = zero;
      // A axis and what both triangles reach along it, B's seen from a corner of A's.
      const auto look = [&](const Vec3& axis, V low_a, V high_a, V low_b, V high_b) {
        const V gap = hn::Max(low_b - high_a, low_a - high_b);
        beyond = hn::Max(beyond, gap * hn::Abs(gap) - reach * reach * dot(axis, axis));
      };
      for (int s = 0; s < 2; ++s) {
        V at[3];
        for (int c = 0; c < 3; ++c) at[c] = dot(normal[s], corner[1 - s][c] - corner[s][0]);
        look(normal[s], zero, zero, min3(at[0], at[1], at[2]), max3(at[0], at[1], at[2]));
      }
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          // Both ends of an edge are one along the axis.
          const Vec3 axis = cross(edge[0][i], edge[1][j]);
          const V other_a = dot(axis, corner[0][(i + 2) % 3] - corner[0][i]);
          const V at_b = dot(axis, corner[1][j] - corner[0][i]);
          const V other_b = at_b + dot(axis, corner[1][(j + 2) % 3] - corner[1][j]);
          look(axis, hn::Min(zero, other_a), hn::Max(zero, other_a), hn::Min(at_b, other_b),
               hn::Max(at_b, other_b));
        }
      apart |= mask_bits(d, beyond > zero) << l;
    }
    for (std::uint32_t left = ((1u << count) - 1) & ~apart; left != 0; left &= left - 1) {
      const auto n = static_cast<std::uint32_t>(std::countr_zero(left));
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
    write_crossings(pairs, heights, pierced, crossing, found_.crossings, scratch_.crossings);
    found_.crossings += added;
    for (; crossing != 0; crossing &= crossing - 1) {
      const int n = std::countr_zero(crossing);
      set(scratch_.a.near, pairs.triangle[0][n] / kWidth);
      set(scratch_.b.near, pairs.triangle[1][n] / kWidth);
    }
  }

  const MeshTree& a_;
  const MeshTree& b_;
  ExactScratch& scratch_;
  PlacedMeshes placed_;
  float pad_b_, reach_, slack_;
  KeptPairs* keep_ = nullptr;   ///< what is near is kept, and not tested yet
  std::uint32_t gathered_ = 0;  ///< for it
  CrossingsFound found_;
};

CrossingsFound search_triangles(const CrossingSearch& search, std::uint32_t first,
                                std::uint32_t next, std::uint32_t count, KeptPairs* keep,
                                ExactScratch& scratch) {
  return TriangleSearch(search, scratch).run(first, next, count, keep);
}

CrossingsFound search_kept(const CrossingSearch& search, const KeptPairs& kept,
                           ExactScratch& scratch) {
  return TriangleSearch(search, scratch).run(kept);
}

SurfaceContact search_contact(const CrossingSearch& search, std::uint32_t count,
                              const KeptPairs* kept, ExactScratch& scratch) {
  return TriangleSearch(search, scratch).contact(count, kept);
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
HWY_EXPORT(search_contact);
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

SurfaceContact find_contact(const CrossingSearch& search, std::uint32_t count,
                            const KeptPairs* kept, ExactScratch& scratch) noexcept {
  return HWY_DYNAMIC_DISPATCH(search_contact)(search, count, kept, scratch);
}

const PlacedVertices& place_block(const CrossingSearch& search, bool of_b, std::uint32_t number,
                                  ExactScratch& scratch) noexcept {
  return HWY_DYNAMIC_DISPATCH(place_one)(search, of_b, number, scratch);
}

}  // namespace ist
#endif
