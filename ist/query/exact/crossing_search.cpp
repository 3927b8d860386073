#include "query/exact/crossing_search.h"

#include <algorithm>
#include <bit>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/exact/crossing_search.cpp"
#include <hwy/foreach_target.h>

#include "query/exact/nearest_points.h"
#include "query/exact/placed_mesh-inl.h"
#include "query/exact/plane_sides-inl.h"
#include "query/exact/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// Finds the triangles that cross in pairs of blocks.
class TriangleSearch {
 public:
  TriangleSearch(const CrossingSearch& search, ExactScratch& scratch)
      : search_(search),
        a_(*search.a),
        b_(*search.b),
        scratch_(scratch),
        placed_(search, scratch),
        pad_b_(pad(search.a_from_b, b_)) {
    look_ahead(search.reach);
    scratch_.pairs->count = 0;
    scratch_.straddling->count = 0;
  }

  CrossingsFound run(std::uint32_t first, std::uint32_t next, std::uint32_t count,
                     KeptPairs* keep) {
    keep_ = keep;
    found_.crossings = first;
    std::uint32_t n = next;
    for (; n < count && found_.complete; ++n) {
      // Two blocks add at most 256, and as many may wait.
      if (keep_ == nullptr && found_.crossings + 2 * 256 > scratch_.most_crossings) break;
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
      add_pair(a, placed_.vertices(false, a / kWidth), b, placed_.vertices(true, b / kWidth));
    }
  }

  CrossingsFound finish() {
    if (found_.complete) test_pairs();
    if (found_.complete) test_edges();
    // Sums go over eight at a time.
    scratch_.crossings.clear(found_.crossings, (found_.crossings + 7) / 8 * 8);
    return found_;
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
    Meeting now(*this, number_a, number_b);
    const auto thin = [&](const float* low, const float* high, std::uint32_t lane) {
      return high[lane] - low[lane] <= 2 * slack_;
    };
    if ((thin(box_a.slab_low, box_a.slab_high, lane_a) && now.beside(false)) ||
        (thin(box_b.slab_low, box_b.slab_high, lane_b) && now.beside(true)))
      return;
    for (; rows != 0; rows &= rows - 1) {
      const auto i = static_cast<std::uint32_t>(std::countr_zero(rows));
      const OneBox box(a.low, a.high, i, reach_);
      std::uint32_t lanes = in_a & meeting(b.low, b.high, box.low, box.high);
      if (lanes != 0) lanes = now.straddling(i, lanes);
      for (; lanes != 0; lanes &= lanes - 1)
        add_pair(kWidth * number_a + i, *now.vertices[0],
                 kWidth * number_b + static_cast<std::uint32_t>(std::countr_zero(lanes)),
                 *now.vertices[1]);
    }
  }

  /// Two blocks whose triangles are tested by the planes of either side, in double. Where a sign is
  /// not settled, a plane does not keep them apart unless both blocks are marked as near anyway.
  class Meeting {
   public:
    Meeting(TriangleSearch& all, std::uint32_t a, std::uint32_t b)
        : vertices{&all.placed_.vertices(false, a), &all.placed_.vertices(true, b)},
          all_(all),
          number_{a, b} {
      const bool near = has(all.scratch_.a.near, a) && has(all.scratch_.b.near, b);
      margin_ = all.keep_ != nullptr ? Margin::reach : near ? Margin::rounding : Margin::room;
      by_ = all.keep_ != nullptr ? double{all.reach_} : double{all.search_.room};
    }

    const PlacedVertices* const vertices[2];

    /// Whether the planes of A's or B's block lie beside the other block as a whole.
    bool beside(bool of_b) {
      const PlacedPlanes& planes = planes_of(of_b);
      const PlaneSides found = sides(of_b, planes.widest, planes.low, planes.high);
      constexpr std::uint32_t kAll = (1u << kWidth) - 1;
      return found.above == kAll || found.below == kAll;
    }

    /// Which of `lanes` of B no plane keeps apart from A's triangle i.
    std::uint32_t straddling(std::uint32_t i, std::uint32_t lanes) {
      const MeshBlock &a = all_.a_.blocks[number_[0]], &b = all_.b_.blocks[number_[1]];
      const PlaneSides row = sides(false, i, 0, 0);
      for (std::uint32_t left = lanes; left != 0; left &= left - 1) {
        const auto j = static_cast<std::uint32_t>(std::countr_zero(left));
        if (keeps_apart(row, b, j)) {
          lanes ^= 1u << j;
          continue;
        }
        if ((known_ >> j & 1) == 0) {
          columns_[j] = sides(true, j, 0, 0);
          known_ |= 1u << j;
        }
        if (keeps_apart(columns_[j], a, i)) lanes ^= 1u << j;
      }
      return lanes;
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
                      (of_b ? -1.0 : 1.0) * all_.search_.aside, margin_, by_);
    }
    static bool keeps_apart(const PlaneSides& sides, const MeshBlock& block, std::uint32_t t) {
      const auto all = [&](std::uint32_t bits) {
        return (bits >> block.corner[0][t] & bits >> block.corner[1][t] &
                bits >> block.corner[2][t] & 1) != 0;
      };
      return all(sides.above) || all(sides.below);
    }

    TriangleSearch& all_;
    std::uint32_t number_[2];
    Margin margin_;
    double by_;
    PlaneSides columns_[kWidth];  ///< of B's planes
    std::uint32_t known_ = 0;
  };

  void add_pair(std::uint32_t triangle_a, const PlacedVertices& vertices_a,
                std::uint32_t triangle_b, const PlacedVertices& vertices_b) {
    TrianglePairs& pairs = *scratch_.pairs;
    const std::uint32_t n = pairs.count;
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
    if (++pairs.count == 8) keep_ == nullptr ? test_pairs() : keep_pairs();
  }

  static HWY_INLINE Vec3 corner_of(const TrianglePairs& pairs, int side, int c, std::size_t l) {
    const D d;
    return {hn::Load(d, pairs.corner[side][c][0] + l), hn::Load(d, pairs.corner[side][c][1] + l),
            hn::Load(d, pairs.corner[side][c][2] + l)};
  }

  static std::uint32_t each(const std::uint32_t (&bits)[3]) { return bits[0] & bits[1] & bits[2]; }
  static std::uint32_t alike(const std::uint32_t (&bits)[3]) {
    return each(bits) | ~(bits[0] | bits[1] | bits[2]);
  }

  /// Heights of eight pairs, and what their signs say: a bit each.
  struct alignas(64) Heights {
    double value[2][3][8], error[2][3][8];  ///< [of A's corners over B's plane, of B's over A's]
    double shift[2][8];                     ///< what moving B aside adds to them, its absolute value
    std::uint32_t positive[2][3] = {};      ///< with B moved aside
    std::uint32_t certain[2][3] = {};       ///< in double
    std::uint32_t settled[2][3] = {};       ///< wherever points move by the room

    /// Pairs that a plane keeps apart.
    std::uint32_t apart(const std::uint32_t (&known)[2][3]) const {
      return (each(known[0]) & alike(positive[0])) | (each(known[1]) & alike(positive[1]));
    }
  };

  HWY_INLINE void find_heights(const TrianglePairs& pairs, Heights& out) const {
    const D d;
    const V room = hn::Set(d, double{search_.room}), filter = hn::Set(d, exact::kFilter);
    const V two = hn::Set(d, 2.0), six_rooms = hn::Set(d, 6.0) * room;
    const Vec3 aside = {hn::Set(d, search_.aside.x), hn::Set(d, search_.aside.y),
                        hn::Set(d, search_.aside.z)};
    for (std::size_t l = 0; l < pairs.count; l += hn::Lanes(d)) {
      Vec3 corner[2][3];
      for (int s = 0; s < 2; ++s)
        for (int c = 0; c < 3; ++c) corner[s][c] = corner_of(pairs, s, c, l);
      for (int side = 0; side < 2; ++side) {
        const Vec3(&plane)[3] = corner[1 - side];
        const Vec3 u = plane[1] - plane[0], v = plane[2] - plane[0];
        const V ax = u.y * v.z, bx = u.z * v.y, ay = u.z * v.x, by = u.x * v.z, az = u.x * v.y,
                bz = u.y * v.x;
        const Vec3 normal = {ax - bx, ay - by, az - bz};
        const Vec3 size = {hn::Abs(ax) + hn::Abs(bx), hn::Abs(ay) + hn::Abs(by),
                           hn::Abs(az) + hn::Abs(bz)};
        const V along = dot(aside, normal), shift = side == 1 ? along : hn::Neg(along);
        const V shift_error = filter * absolute_dot(aside, size);
        hn::Store(hn::Abs(along), d, out.shift[side] + l);
        const V longest = hn::Max(largest(u), largest(v)) + room;
        for (int c = 0; c < 3; ++c) {
          const Vec3 r = corner[side][c] - plane[0];
          const V value = dot(r, normal), error = filter * absolute_dot(r, size);
          const V moved = value + shift, away = hn::Abs(moved), sure = error + shift_error;
          // What the room moves: six products of three numbers.
          const V unsettled = sure + six_rooms * longest * (two * largest(r) + longest);
          hn::Store(value, d, out.value[side][c] + l);
          // Where moving aside decides, the plane may lie on the other side of the corner.
          const V height = hn::Abs(value);
          hn::Store(error + hn::IfThenElseZero(height <= hn::Abs(shift), height), d,
                    out.error[side][c] + l);
          out.positive[side][c] |= mask_bits(d, moved > hn::Zero(d)) << l;
          out.certain[side][c] |= mask_bits(d, away > sure) << l;
          out.settled[side][c] |= mask_bits(d, away > unsettled) << l;
        }
      }
    }
  }

  struct ExactCorners {
    exact::Point of[2][3];

    ExactCorners(const TrianglePairs& pairs, std::uint32_t n) {
      for (int s = 0; s < 2; ++s)
        for (int c = 0; c < 3; ++c)
          of[s][c] = {pairs.corner[s][c][0][n], pairs.corner[s][c][1][n], pairs.corner[s][c][2][n]};
    }
  };

  static void put(std::uint32_t& bits, std::uint32_t n, bool bit) {
    bits = (bits & ~(1u << n)) | static_cast<std::uint32_t>(bit) << n;
  }

  /// Of pair n, where doubles leave a sign unclear.
  HWY_NOINLINE void find_heights_exactly(const TrianglePairs& pairs, std::uint32_t n,
                                         Heights& out) const {
    const ExactCorners corners(pairs, n);
    for (int s = 1; s >= 0; --s) {
      for (int c = 0; c < 3; ++c) {
        if (out.certain[s][c] >> n & 1) continue;
        const exact::Determinant height =
            s == 1 ? exact::height_over_a(corners.of[0], corners.of[1][c], search_.aside)
                   : exact::height_over_b(corners.of[1], corners.of[0][c], search_.aside);
        out.value[s][c][n] = height.value;
        out.error[s][c][n] =
            height.error + (height.value * height.sign < 0 ? std::abs(height.value) : 0);
        put(out.positive[s][c], n, height.sign > 0);
        put(out.certain[s][c], n, true);
      }
      if ((out.apart(out.certain) >> n & 1) != 0) return;
    }
  }

  /// Tests what has been gathered by the planes of both triangles.
  void test_pairs() {
    TrianglePairs& pairs = *scratch_.pairs;
    const std::uint32_t count = pairs.count, all = (1u << count) - 1;
    if (count == 0 || !found_.complete) return;  // two blocks go on to their end
    Heights heights;
    find_heights(pairs, heights);
    pairs.count = 0;
    const std::uint32_t certain = each(heights.certain[0]) & each(heights.certain[1]);
    for (std::uint32_t left = all & ~heights.apart(heights.certain) & ~certain; left != 0;
         left &= left - 1)
      find_heights_exactly(pairs, static_cast<std::uint32_t>(std::countr_zero(left)), heights);
    const std::uint32_t apart = heights.apart(heights.certain);
    std::uint32_t unsettled = all & apart & ~heights.apart(heights.settled);
    if (unsettled != 0) unsettled &= ~far_in_planes(pairs, count);
    for (std::uint32_t left = unsettled; left != 0; left &= left - 1)
      note_near(pairs, static_cast<std::uint32_t>(std::countr_zero(left)));
    for (std::uint32_t left = all & ~apart; left != 0; left &= left - 1)
      add_straddling(pairs, heights, static_cast<std::uint32_t>(std::countr_zero(left)));
  }

  /// Pairs that are further apart than is near along the plane of one of them, as those in one plane
  /// may be.
  HWY_NOINLINE std::uint32_t far_in_planes(const TrianglePairs& pairs, std::uint32_t count) const {
    const D d;
    std::uint32_t out = 0;
    const V least = hn::Set(d, double{search_.near} * double{search_.near} * (1 + 1e-6));
    for (std::size_t l = 0; l < count; l += hn::Lanes(d)) {
      Vec3 corner[2][3];
      for (int s = 0; s < 2; ++s)
        for (int c = 0; c < 3; ++c) corner[s][c] = corner_of(pairs, s, c, l);
      for (int s = 0; s < 2; ++s) {
        const Vec3 normal = cross(corner[s][1] - corner[s][0], corner[s][2] - corner[s][0]);
        for (int k = 0; k < 3; ++k) {
          const Vec3 &p = corner[s][k], out_of = cross(corner[s][(k + 1) % 3] - p, normal);
          const V gap = min3(dot(out_of, corner[1 - s][0] - p), dot(out_of, corner[1 - s][1] - p),
                             dot(out_of, corner[1 - s][2] - p));
          out |= mask_bits(d, gap * hn::Abs(gap) > least * dot(out_of, out_of)) << l;
        }
      }
    }
    return out;
  }

  void add_straddling(const TrianglePairs& pairs, const Heights& heights, std::uint32_t from) {
    StraddlingPairs& out = *scratch_.straddling;
    const std::uint32_t n = out.count;
    bool settled = true;
    for (int s = 0; s < 2; ++s) {
      out.triangle[s][n] = pairs.triangle[s][from];
      out.shift[s][n] = heights.shift[s][from];
      for (int c = 0; c < 3; ++c) {
        for (int k = 0; k < 3; ++k) out.corner[s][c][k][n] = pairs.corner[s][c][k][from];
        out.height[s][c][n] = heights.value[s][c][from];
        out.error[s][c][n] = heights.error[s][c][from];
        put(out.positive[s][c], n, (heights.positive[s][c] >> from & 1) != 0);
        settled &= (heights.settled[s][c] >> from & 1) != 0;
      }
    }
    put(out.settled, n, settled);
    if (++out.count == 8) test_edges();
  }

  /// Which way round A's edges go about B's: a bit a pair.
  struct WaysRound {
    std::uint32_t positive[3][3] = {};  ///< [A's edge][B's edge]
    std::uint32_t certain[3][3] = {}, settled[3][3] = {};

    /// Pairs of which an edge, that goes through the other's plane (`parts`: A's, B's), may go
    /// through the triangle as far as `known` tells.
    void may_pierce(const std::uint32_t (&parts)[2][3], const std::uint32_t (&known)[3][3],
                    std::uint32_t (&out)[2][3]) const {
      for (int k = 0; k < 3; ++k)
        for (int s = 0; s < 2; ++s) {
          std::uint32_t plus = 0, minus = 0;
          for (int j = 0; j < 3; ++j) {
            const int a = s == 0 ? k : j, b = s == 0 ? j : k;
            plus |= known[a][b] & positive[a][b];
            minus |= known[a][b] & ~positive[a][b];
          }
          out[s][k] = parts[s][k] & ~(plus & minus);
        }
    }
    /// Whether all signs that matter are known.
    std::uint32_t decided(const std::uint32_t (&parts)[2][3],
                          const std::uint32_t (&known)[3][3]) const {
      std::uint32_t asked[2][3], out = ~0u;
      may_pierce(parts, known, asked);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) out &= ~(asked[0][i] | asked[1][j]) | known[i][j];
      return out;
    }
  };

  HWY_INLINE void find_ways_round(const TrianglePairs& pairs, WaysRound& out) const {
    const D d;
    const V room = hn::Set(d, double{search_.room});
    const V filter = hn::Set(d, 6 * exact::kFilter), six_rooms = hn::Set(d, 6.0) * room;
    const Vec3 aside = {hn::Set(d, search_.aside.x), hn::Set(d, search_.aside.y),
                        hn::Set(d, search_.aside.z)};
    const V by_aside = largest(aside);
    for (std::size_t l = 0; l < pairs.count; l += hn::Lanes(d)) {
      Vec3 corner[2][3], edge_b[3];
      V size_b[3];
      for (int s = 0; s < 2; ++s)
        for (int c = 0; c < 3; ++c) corner[s][c] = corner_of(pairs, s, c, l);
      for (int j = 0; j < 3; ++j) {
        edge_b[j] = corner[1][(j + 1) % 3] - corner[1][j];
        size_b[j] = largest(edge_b[j]) + room;
      }
      for (int i = 0; i < 3; ++i) {
        const Vec3 edge_a = corner[0][(i + 1) % 3] - corner[0][i];
        const V size_a = largest(edge_a) + room;
        for (int j = 0; j < 3; ++j) {
          const Vec3 r = corner[1][j] - corner[0][i], normal = cross(edge_a, edge_b[j]);
          const V value = dot(r, normal) + dot(aside, normal), size = largest(r) + by_aside;
          const V error = filter * size_a * size * size_b[j];
          const V moved = six_rooms * (size_a * size_b[j] + size * (size_a + size_b[j]));
          out.positive[i][j] |= mask_bits(d, value > hn::Zero(d)) << l;
          out.certain[i][j] |= mask_bits(d, hn::Abs(value) > error) << l;
          out.settled[i][j] |= mask_bits(d, hn::Abs(value) > error + moved) << l;
        }
      }
    }
  }

  /// Tests by edges what planes left.
  void test_edges() {
    StraddlingPairs& pairs = *scratch_.straddling;
    const std::uint32_t count = pairs.count, all = (1u << count) - 1;
    if (count == 0 || !found_.complete) return;
    WaysRound round;
    find_ways_round(pairs, round);
    pairs.count = 0;
    std::uint32_t parts[2][3], pierced[2][3];
    for (int s = 0; s < 2; ++s)
      for (int k = 0; k < 3; ++k)
        parts[s][k] = pairs.positive[s][k] ^ pairs.positive[s][(k + 1) % 3];
    for (std::uint32_t left = all & ~(pairs.settled & round.decided(parts, round.settled));
         left != 0; left &= left - 1)
      note_near(pairs, static_cast<std::uint32_t>(std::countr_zero(left)));
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
    if (twice != 0) add_crossings(pairs, pierced, twice);
  }

  HWY_NOINLINE void find_round_exactly(const TrianglePairs& pairs,
                                       const std::uint32_t (&parts)[2][3], std::uint32_t n,
                                       WaysRound& out) const {
    const ExactCorners corners(pairs, n);
    const exact::Point(&a)[3] = corners.of[0], (&b)[3] = corners.of[1];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        if (((parts[0][i] | parts[1][j]) >> n & 1) == 0 || (out.certain[i][j] >> n & 1) != 0)
          continue;
        const int sign =
            exact::way_round(a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3], search_.aside).sign;
        put(out.positive[i][j], n, sign > 0);
        put(out.certain[i][j], n, true);
      }
  }

  /// A pair whose signs might be others if points moved by the room marks its blocks, if it is as
  /// near: the same ones whichever search found it.
  HWY_NOINLINE void note_near(const TrianglePairs& pairs, std::uint32_t n) {
    const std::uint32_t block_a = pairs.triangle[0][n] / kWidth,
                        block_b = pairs.triangle[1][n] / kWidth;
    if (has(scratch_.a.near, block_a) && has(scratch_.b.near, block_b)) return;
    const ExactCorners corners(pairs, n);
    if (!exact::come_within(search_.near, corners.of[0], corners.of[1])) return;
    set(scratch_.a.near, block_a);
    set(scratch_.b.near, block_b);
  }

  /// Keeps of what has been gathered what no plane along a triangle or along an edge of each keeps
  /// as far apart as the search reaches.
  HWY_NOINLINE void keep_pairs() {
    const D d;
    const TrianglePairs& pairs = *scratch_.pairs;
    const std::uint32_t count = pairs.count;
    scratch_.pairs->count = 0;
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

  /// Where an edge, from p to q, goes through the other triangle.
  struct Piercing {
    Vec3 p, q;
    V height_p, height_q, error, shift, edge;
  };

  void add_crossings(const StraddlingPairs& pairs, const std::uint32_t (&pierced)[2][3],
                     std::uint32_t crossing) {
    const auto added = static_cast<std::uint32_t>(std::popcount(crossing));
    if (found_.crossings + added > scratch_.most_crossings) {
      found_.complete = false;
      return;
    }
    Crossings& out = scratch_.crossings;
    std::uint32_t at = found_.crossings;
    found_.crossings += added;
    for (std::uint32_t left = crossing, i = at; left != 0; left &= left - 1, ++i) {
      const auto n = static_cast<std::uint32_t>(std::countr_zero(left));
      out.triangle(0, i) = pairs.triangle[0][n];
      out.triangle(1, i) = pairs.triangle[1][n];
      set(scratch_.a.near, pairs.triangle[0][n] / kWidth);
      set(scratch_.b.near, pairs.triangle[1][n] / kWidth);
    }
    const D d;
    const std::uint32_t lanes = (1u << hn::Lanes(d)) - 1;
    for (std::size_t l = 0; l < 8; l += hn::Lanes(d)) {
      const std::uint32_t here = crossing >> l & lanes;
      if (here == 0) continue;
      const Compressor<D> chosen(d, mask_of_bits(d, here));
      Piercing end[2];
      for (Piercing& e : end) {
        const V zero = hn::Zero(d);
        e = {{zero, zero, zero}, {zero, zero, zero}, zero, zero, zero, zero, zero};
      }
      for (int edge = 0; edge < 6; ++edge) {
        const int s = edge / 3, k = edge % 3, next = (k + 1) % 3;
        if ((pierced[s][k] & crossing) == 0) continue;
        const Vec3 p = corner_of(pairs, s, k, l), q = corner_of(pairs, s, next, l);
        const V hp = hn::Load(d, pairs.height[s][k] + l),
                hq = hn::Load(d, pairs.height[s][next] + l);
        const V error = hn::Load(d, pairs.error[s][k] + l) + hn::Load(d, pairs.error[s][next] + l);
        // An edge that goes down enters the other solid.
        const std::uint32_t down = pairs.positive[s][k], ends = s == 0 ? down : ~down;
        for (int e = 0; e < 2; ++e) {
          const auto take =
              mask_of_bits(d, pierced[s][k] >> l & (e == 1 ? ends : ~ends) >> l & lanes);
          const auto put = [&](V& to, V from) { to = hn::IfThenElse(take, from, to); };
          put(end[e].p.x, p.x);
          put(end[e].p.y, p.y);
          put(end[e].p.z, p.z);
          put(end[e].q.x, q.x);
          put(end[e].q.y, q.y);
          put(end[e].q.z, q.z);
          put(end[e].height_p, hp);
          put(end[e].height_q, hq);
          put(end[e].error, error);
          put(end[e].shift, hn::Load(d, pairs.shift[s] + l));
          put(end[e].edge, hn::Set(d, static_cast<double>(edge)));
        }
      }
      for (int e = 0; e < 2; ++e) add_end(end[e], chosen, e, at);
      at += static_cast<std::uint32_t>(chosen.count());
    }
  }

  void add_end(const Piercing& from, const Compressor<D>& chosen, int e, std::uint32_t at) {
    const D d;
    const V hp = hn::Abs(from.height_p), hq = hn::Abs(from.height_q), whole = hp + hq;
    // From the nearer end, and between two as near from the first in space, so that both triangles
    // at an edge do alike.
    const Vec3 &p = from.p, &q = from.q;
    const auto before =
        hn::Or(q.x < p.x, hn::And(q.x == p.x, hn::Or(q.y < p.y, hn::And(q.y == p.y, q.z < p.z))));
    const auto turned = hn::Or(hq < hp, hn::And(hq == hp, before));
    // An edge in the plane has both ends on one side, yet their heights may be rounded to 0.
    const auto flat = whole == hn::Zero(d);
    const V one = hn::Set(d, 1.0), two = hn::Set(d, 2.0);
    const V share =
        hn::IfThenElse(flat, hn::Set(d, 0.5), hn::Min(hp, hq) / hn::IfThenElse(flat, one, whole));
    const auto put = [&](int number, V value) {
      hn::StoreU(chosen(value), d, scratch_.crossings.end(e, number) + at);
    };
    const auto coordinate = [&](int k, V at_p, V at_q) {
      const V near = hn::IfThenElse(turned, at_q, at_p), far = hn::IfThenElse(turned, at_p, at_q);
      put(Crossings::kFrom + k, near);
      put(Crossings::kOffset + k, share * (far - near));
    };
    coordinate(0, p.x, q.x);
    coordinate(1, p.y, q.y);
    coordinate(2, p.z, q.z);
    put(Crossings::kT, hn::IfThenElse(turned, one - share, share));
    put(Crossings::kTError,
        hn::IfThenElse(
            flat, one,
            // Which of two places comes first is asked with B moved aside.
            two * (from.error + two * from.shift) / hn::IfThenElse(flat, one, whole) +
                hn::Set(d, 1e-15)));
    put(Crossings::kHeightError, from.error);
    put(Crossings::kEdge, hn::IfThenElse(turned, from.edge, from.edge + hn::Set(d, 8.0)));
  }

  const CrossingSearch& search_;
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
HWY_EXPORT(place_one);

CrossingsFound find_crossings(const CrossingSearch& search, std::uint32_t first,
                              std::uint32_t next, std::uint32_t count, KeptPairs* keep,
                              ExactScratch& scratch) noexcept {
  return HWY_DYNAMIC_DISPATCH(search_triangles)(search, first, next, count, keep, scratch);
}

CrossingsFound find_kept_crossings(const CrossingSearch& search, const KeptPairs& kept,
                                   ExactScratch& scratch) noexcept {
  return HWY_DYNAMIC_DISPATCH(search_kept)(search, kept, scratch);
}

const PlacedVertices& place_block(const CrossingSearch& search, bool of_b, std::uint32_t number,
                                  ExactScratch& scratch) noexcept {
  return HWY_DYNAMIC_DISPATCH(place_one)(search, of_b, number, scratch);
}

}  // namespace ist
#endif
