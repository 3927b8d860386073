#include "query/exact/crossing_search.h"

#include <algorithm>
#include <bit>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/exact/crossing_search.cpp"
#include <hwy/foreach_target.h>

#include "query/kernel/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

using exact::Corners;
using exact::Crossing;
using exact::Determinant;

/// Relative error of a few float operations.
inline constexpr float kFloatError = 4e-7f;
/// Where empty boxes lie. Infinities would be subtracted from each other.
inline constexpr float kNowhere = 1e30f;

class Search {
 public:
  Search(const CrossingSearch& search, ExactScratch& scratch)
      : search_(search), a_(*search.a), b_(*search.b), scratch_(scratch) {
    pad_b_ = pad(search.a_from_b, b_);
    pad_a_ = pad(search.b_from_a, a_);
    room_b_ = static_cast<float>(search.room * search.b_from_a.scale);
    scale_ = static_cast<float>(search.a_from_b.scale) * (1 + kFloatError);
    for (int k = 0; k < 9; ++k)
      turn_[k] = static_cast<float>(search.a_from_b.m[k] / search.a_from_b.scale);
    pad_a_here_ = pad(Similarity::identity(), a_);
  }

  CrossingsFound run() {
    scratch_.boxes_a->forget();
    scratch_.boxes_b->forget();
    scratch_.triangles_a->forget();
    scratch_.triangles_b->forget();
    scratch_.pairs->count = 0;
    waiting_ = 0;
    push(a_.top, 0, b_.top, 0);
    while (waiting_ > 0 && found_.complete) {
      const BoxPair pair = scratch_.waiting[--waiting_];
      if (pair.level_a == 0)
        open_b(pair);
      else if (pair.level_b == 0)
        open_a(pair);
      else
        open_both(pair);
      if (++found_.visits == search_.max_visits && waiting_ > 0) found_.complete = false;
    }
    if (found_.complete) test_pairs();
    return found_;
  }

 private:
  using F = LaneTag<float>;

  /// What rounding may do to a box that is placed in floats.
  static float pad(const Similarity& map, const MeshTree& tree) {
    double extent = 0, shift = 0;
    const BoxBlock& root = tree.level[tree.top].boxes[0];
    for (int k = 0; k < 3; ++k) {
      for (std::uint32_t l = 0; l < kWidth; ++l)
        if (root.low[k][l] <= root.high[k][l])
          extent = std::max(
              {extent, std::abs(double{root.low[k][l]}), std::abs(double{root.high[k][l]})});
      shift = std::max(shift, std::abs(map.t[k]));
    }
    return static_cast<float>(1e-6 * (2 * map.scale * extent + shift));
  }

  void push(int level_a, std::uint32_t a, int level_b, std::uint32_t b) {
    if (level_a == 0 && level_b == 0) {
      meet(a, b);
    } else if (waiting_ == ExactScratch::kMostWaiting) {
      found_.complete = false;
    } else {
      scratch_.waiting[waiting_++] = {a, b, static_cast<std::uint8_t>(level_a),
                                      static_cast<std::uint8_t>(level_b)};
    }
  }

  /// The boxes below a box block, seen from the other solid.
  template <class Cache>
  static const PlacedBoxes& placed(const MeshTree& tree, int level, std::uint32_t i,
                                   const Similarity& map, float pad, Cache& cache) {
    const std::uint32_t number = tree.level[level].first + i;
    PlacedBoxes& out = cache.placed[number % std::size(cache.number)];
    std::uint32_t& held = cache.number[number % std::size(cache.number)];
    if (held == number) return out;
    held = number;
    const BoxBlock& from = tree.level[level].boxes[i];
    const F d;
    float m[9], turn[9], size[9], t[3];
    for (int k = 0; k < 9; ++k) {
      m[k] = static_cast<float>(map.m[k]);
      turn[k] = static_cast<float>(map.m[k] / map.scale);
      size[k] = std::abs(m[k]) * (1 + kFloatError);
    }
    for (int k = 0; k < 3; ++k) t[k] = static_cast<float>(map.t[k]);
    const auto half = hn::Set(d, 0.5f);
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      hn::Vec<F> middle[3], extent[3];
      for (int k = 0; k < 3; ++k) {
        const auto low = hn::Load(d, from.low[k] + l), high = hn::Load(d, from.high[k] + l);
        middle[k] = half * (low + high);
        extent[k] = half * (high - low);
      }
      // Unused lanes have extents below zero, and stay empty.
      for (int k = 0; k < 3; ++k) {
        const auto c = (hn::Set(d, m[3 * k]) * middle[0] + hn::Set(d, m[3 * k + 1]) * middle[1]) +
                       (hn::Set(d, m[3 * k + 2]) * middle[2] + hn::Set(d, t[k]));
        const auto h =
            (hn::Set(d, size[3 * k]) * extent[0] + hn::Set(d, size[3 * k + 1]) * extent[1]) +
            (hn::Set(d, size[3 * k + 2]) * extent[2] + hn::Set(d, pad));
        hn::Store(c - h, d, out.low[k] + l);
        hn::Store(c + h, d, out.high[k] + l);
      }
      hn::Vec<F> shift = hn::Zero(d);
      for (int k = 0; k < 3; ++k) {
        const auto turned = (hn::Set(d, turn[3 * k]) * hn::Load(d, from.normal[0] + l) +
                             hn::Set(d, turn[3 * k + 1]) * hn::Load(d, from.normal[1] + l)) +
                            hn::Set(d, turn[3 * k + 2]) * hn::Load(d, from.normal[2] + l);
        hn::Store(turned, d, out.normal[k] + l);
        shift = shift + turned * hn::Set(d, t[k]);
      }
      const auto scale = hn::Set(d, static_cast<float>(map.scale)), room = hn::Set(d, 2 * pad);
      hn::Store((scale * hn::Load(d, from.slab_low + l) + shift) - room, d, out.slab_low + l);
      hn::Store((scale * hn::Load(d, from.slab_high + l) + shift) + room, d, out.slab_high + l);
    }
    const std::uint32_t used = used_lanes(tree, level, i);
    for (int k = 0; k < 3; ++k) {
      for (std::uint32_t l = used; l < kWidth; ++l)
        out.low[k][l] = kNowhere, out.high[k][l] = -kNowhere;
      out.all_low[k] = lowest(out.low[k]);
      out.all_high[k] = highest(out.high[k]);
    }
    return out;
  }

  static std::uint32_t used_lanes(const MeshTree& tree, int level, std::uint32_t i) {
    return std::min(kWidth, tree.level[level - 1].count - kWidth * i);
  }

  static float lowest(const float* lanes) {
    const F d;
    auto least = hn::Load(d, lanes);
    for (std::size_t l = hn::Lanes(d); l < kWidth; l += hn::Lanes(d))
      least = hn::Min(least, hn::Load(d, lanes + l));
    return hn::GetLane(hn::MinOfLanes(d, least));
  }
  static float highest(const float* lanes) {
    const F d;
    auto most = hn::Load(d, lanes);
    for (std::size_t l = hn::Lanes(d); l < kWidth; l += hn::Lanes(d))
      most = hn::Max(most, hn::Load(d, lanes + l));
    return hn::GetLane(hn::MaxOfLanes(d, most));
  }

  /// Which of sixteen boxes meet one.
  static HWY_INLINE std::uint32_t meeting(const float (&low)[3][kWidth],
                                          const float (&high)[3][kWidth], const float* one_low,
                                          const float* one_high) {
    const F d;
    std::uint32_t bits = 0;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      auto mask = hn::And(hn::Load(d, low[0] + l) <= hn::Set(d, one_high[0]),
                          hn::Load(d, high[0] + l) >= hn::Set(d, one_low[0]));
      for (int k = 1; k < 3; ++k)
        mask = hn::And(mask, hn::And(hn::Load(d, low[k] + l) <= hn::Set(d, one_high[k]),
                                     hn::Load(d, high[k] + l) >= hn::Set(d, one_low[k])));
      bits |= mask_bits(d, mask) << l;
    }
    return bits;
  }

  struct OneBox {
    float low[3], high[3];
    OneBox(const float (&l)[3][kWidth], const float (&h)[3][kWidth], std::uint32_t lane,
           float room) {
      for (int k = 0; k < 3; ++k) low[k] = l[k][lane] - room, high[k] = h[k][lane] + room;
    }
  };

  /// Which boxes of B reach into the slab of a box of A and have it reach into theirs.
  std::uint32_t in_slabs(const BoxBlock& of_a, std::uint32_t i, const BoxBlock& of_b,
                         const PlacedBoxes& b_in_a) const {
    const F d;
    const auto half = hn::Set(d, 0.5f);
    float normal[3], middle[3], extent[3], turned[3];
    for (int k = 0; k < 3; ++k) {
      normal[k] = of_a.normal[k][i];
      middle[k] = 0.5f * (of_a.low[k][i] + of_a.high[k][i]);
      extent[k] = 0.5f * (of_a.high[k][i] - of_a.low[k][i]);
    }
    for (int k = 0; k < 3; ++k)
      turned[k] =
          std::abs((turn_[k] * normal[0] + turn_[3 + k] * normal[1]) + turn_[6 + k] * normal[2]) +
          kFloatError;
    const float slack = 2 * pad_b_ + 2 * pad_a_here_ + search_.room * 2;
    std::uint32_t bits = 0;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      auto along = hn::Zero(d), reach = hn::Set(d, slack);
      auto along_b = hn::Zero(d), reach_b = hn::Set(d, slack);
      for (int k = 0; k < 3; ++k) {
        along = along + hn::Set(d, normal[k]) *
                            (hn::Load(d, b_in_a.low[k] + l) + hn::Load(d, b_in_a.high[k] + l));
        reach = reach + hn::Set(d, turned[k] * scale_) *
                            (hn::Load(d, of_b.high[k] + l) - hn::Load(d, of_b.low[k] + l)) * half;
        const auto n = hn::Load(d, b_in_a.normal[k] + l);
        along_b = along_b + n * hn::Set(d, middle[k]);
        reach_b = reach_b + hn::Abs(n) * hn::Set(d, extent[k]);
      }
      along = along * half;
      const auto in_a = hn::And(along - reach <= hn::Set(d, of_a.slab_high[i]),
                                along + reach >= hn::Set(d, of_a.slab_low[i]));
      const auto in_b = hn::And(along_b - reach_b <= hn::Load(d, b_in_a.slab_high + l),
                                along_b + reach_b >= hn::Load(d, b_in_a.slab_low + l));
      bits |= mask_bits(d, hn::And(in_a, in_b)) << l;
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

  const PlacedBoxes& placed_a(int level, std::uint32_t i) {
    return placed(a_, level, i, search_.b_from_a, pad_a_, *scratch_.boxes_a);
  }
  const PlacedBoxes& placed_b(int level, std::uint32_t i) {
    return placed(b_, level, i, search_.a_from_b, pad_b_, *scratch_.boxes_b);
  }

  void open_both(const BoxPair& pair) {
    const BoxBlock& boxes_a = a_.level[pair.level_a].boxes[pair.a];
    const BoxBlock& boxes_b = b_.level[pair.level_b].boxes[pair.b];
    const PlacedBoxes& a_in_b = placed_a(pair.level_a, pair.a);
    const PlacedBoxes& b_in_a = placed_b(pair.level_b, pair.b);
    OneBox all(boxes_a.low, boxes_a.high, 0, 0);
    for (int k = 0; k < 3; ++k) {
      all.low[k] = b_in_a.all_low[k] - search_.room;
      all.high[k] = b_in_a.all_high[k] + search_.room;
    }
    // Unused lanes meet what is large enough.
    std::uint32_t rows = meeting(boxes_a.low, boxes_a.high, all.low, all.high) &
                         ((1u << used_lanes(a_, pair.level_a, pair.a)) - 1);
    for (; rows != 0; rows &= rows - 1) {
      const auto i = static_cast<std::uint32_t>(std::countr_zero(rows));
      const OneBox here(boxes_a.low, boxes_a.high, i, search_.room);
      std::uint32_t columns = meeting(b_in_a.low, b_in_a.high, here.low, here.high);
      if (columns == 0) continue;
      const OneBox there(a_in_b.low, a_in_b.high, i, room_b_);
      columns &= meeting(boxes_b.low, boxes_b.high, there.low, there.high);
      if (columns != 0) columns &= in_slabs(boxes_a, i, boxes_b, b_in_a);
      for (; columns != 0; columns &= columns - 1)
        push(pair.level_a - 1, kWidth * pair.a + i, pair.level_b - 1,
             kWidth * pair.b + static_cast<std::uint32_t>(std::countr_zero(columns)));
    }
  }

  /// A's side is a block.
  void open_b(const BoxPair& pair) {
    const std::uint32_t lane = pair.a % kWidth, parent = pair.a / kWidth;
    const OneBox here(a_.level[1].boxes[parent].low, a_.level[1].boxes[parent].high, lane,
                      search_.room);
    const PlacedBoxes& b_in_a = placed_b(pair.level_b, pair.b);
    for (std::uint32_t found = meeting(b_in_a.low, b_in_a.high, here.low, here.high); found != 0;
         found &= found - 1)
      push(0, pair.a, pair.level_b - 1,
           kWidth * pair.b + static_cast<std::uint32_t>(std::countr_zero(found)));
  }

  void open_a(const BoxPair& pair) {
    const PlacedBoxes& b_in_a = placed_b(1, pair.b / kWidth);
    const OneBox there(b_in_a.low, b_in_a.high, pair.b % kWidth, search_.room);
    const BoxBlock& boxes = a_.level[pair.level_a].boxes[pair.a];
    std::uint32_t found = meeting(boxes.low, boxes.high, there.low, there.high) &
                          ((1u << used_lanes(a_, pair.level_a, pair.a)) - 1);
    for (; found != 0; found &= found - 1)
      push(pair.level_a - 1, kWidth * pair.a + static_cast<std::uint32_t>(std::countr_zero(found)),
           0, pair.b);
  }

  /// A block's triangles in A's unit frame; `map` is null for A's own.
  template <class Cache>
  static const PlacedTriangles& placed(const MeshTree& tree, std::uint32_t number,
                                       const Similarity* map, Cache& cache) {
    PlacedTriangles& out = cache.placed[number % std::size(cache.number)];
    std::uint32_t& held = cache.number[number % std::size(cache.number)];
    if (held == number) return out;
    held = number;
    const MeshBlock& block = tree.blocks[number];
    alignas(64) double from[3][kWidth];
    for (std::uint32_t v = 0; v < kWidth; ++v) {
      const double* x = tree.vertices + std::size_t{3} * block.vertex[v];
      for (int k = 0; k < 3; ++k) from[k][v] = x[k];
    }
    const hn::CappedTag<double, 8> dd;
    const hn::Rebind<float, decltype(dd)> df;
    alignas(64) float at[3][kWidth];
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(dd)) {
      const auto x = hn::Load(dd, from[0] + l), y = hn::Load(dd, from[1] + l),
                 z = hn::Load(dd, from[2] + l);
      for (int k = 0; k < 3; ++k) {
        auto moved = hn::Load(dd, from[k] + l);
        if (map != nullptr)
          moved = ((hn::Set(dd, map->m[3 * k]) * x + hn::Set(dd, map->m[3 * k + 1]) * y) +
                   hn::Set(dd, map->m[3 * k + 2]) * z) +
                  hn::Set(dd, map->t[k]);
        hn::Store(moved, dd, out.vertex[k] + l);
        hn::Store(hn::DemoteTo(df, moved), df, at[k] + l);
      }
    }
    const F d;
    float reach = 0, size = 0;
    for (int k = 0; k < 3; ++k) {
      const float low = lowest(at[k]), high = highest(at[k]);
      reach = std::max({reach, std::abs(low), std::abs(high)});
      size += (high - low) * (high - low);
    }
    const hn::RebindToSigned<F> di;
    for (int c = 0; c < 3; ++c)
      for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
        const auto from_lane =
            hn::PromoteTo(di, hn::LoadU(hn::Rebind<std::uint8_t, F>(), block.corner[c] + l));
        for (int k = 0; k < 3; ++k) {
          if constexpr (hn::MaxLanes(F()) == kWidth)
            hn::Store(hn::TableLookupLanes(hn::Load(d, at[k]), hn::IndicesFromVec(d, from_lane)), d,
                      out.corner[c][k] + l);
          else
            hn::Store(hn::GatherIndex(d, at[k], from_lane), d, out.corner[c][k] + l);
        }
      }
    out.reach = reach;
    out.size = std::sqrt(size) * (1 + kFloatError) + reach * kFloatError;
    const auto outward = hn::Set(d, reach * 2e-7f);
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      hn::Vec<F> u[3], v[3], n[3];
      for (int k = 0; k < 3; ++k) {
        const auto p = hn::Load(d, out.corner[0][k] + l), q = hn::Load(d, out.corner[1][k] + l),
                   r = hn::Load(d, out.corner[2][k] + l);
        hn::Store(hn::Min(p, hn::Min(q, r)) - outward, d, out.low[k] + l);
        hn::Store(hn::Max(p, hn::Max(q, r)) + outward, d, out.high[k] + l);
        u[k] = q - p;
        v[k] = r - p;
      }
      for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        n[k] = u[i] * v[j] - u[j] * v[i];
        hn::Store(n[k], d, out.normal[k] + l);
      }
      hn::Store(
          (n[0] * hn::Load(d, out.corner[0][0] + l) + n[1] * hn::Load(d, out.corner[0][1] + l)) +
              n[2] * hn::Load(d, out.corner[0][2] + l),
          d, out.offset + l);
      // Corners are rounded, so sides are off by some reach, and normals by that times the other
      // side; what a product of sides loses to rounding comes on top.
      const auto length = [](const hn::Vec<F>(&x)[3]) {
        return hn::Abs(x[0]) + (hn::Abs(x[1]) + hn::Abs(x[2]));
      };
      const auto lu = length(u), lv = length(v);
      hn::Store(length(n), d, out.length + l);
      hn::Store(hn::Set(d, 6e-7f) * (hn::Set(d, reach) * hn::Max(lu, lv) + lu * lv), d,
                out.slack + l);
    }
    for (int k = 0; k < 3; ++k) {
      out.all_low[k] = lowest(out.low[k]);
      out.all_high[k] = highest(out.high[k]);
      for (std::uint32_t l = block.triangles; l < kWidth; ++l)
        out.low[k][l] = kNowhere, out.high[k][l] = -kNowhere;
    }
    return out;
  }

  static void mark(HookedArray<std::uint64_t>& bits, std::uint32_t i) {
    bits[i / 64] |= std::uint64_t{1} << i % 64;
  }

  /// Lanes whose three corners do not all lie clear on one side of a plane.
  template <class Height>
  static HWY_INLINE std::uint32_t straddling(hn::Vec<F> over, const Height& height) {
    const F d;
    const auto h0 = height(0), h1 = height(1), h2 = height(2);
    return mask_bits(d, hn::And(hn::Min(h0, hn::Min(h1, h2)) <= over,
                                hn::Max(h0, hn::Max(h1, h2)) >= hn::Neg(over)));
  }

  /// Tests the triangles of two blocks by boxes and planes.
  void meet(std::uint32_t number_a, std::uint32_t number_b) {
    const PlacedTriangles& a = placed(a_, number_a, nullptr, *scratch_.triangles_a);
    const PlacedTriangles& b = placed(b_, number_b, &search_.a_from_b, *scratch_.triangles_b);
    float low[3], high[3];
    for (int k = 0; k < 3; ++k) {
      low[k] = b.all_low[k] - search_.room;
      high[k] = b.all_high[k] + search_.room;
    }
    std::uint32_t rows = meeting(a.low, a.high, low, high);
    const float slack = 2 * pad_b_ + 2 * pad_a_here_ + search_.room * 2;
    const BoxBlock& box_a = a_.level[1].boxes[number_a / kWidth];
    const PlacedBoxes& box_b = placed_b(1, number_b / kWidth);
    const std::uint32_t lane_a = number_a % kWidth, lane_b = number_b % kWidth;
    const float normal_a[3] = {box_a.normal[0][lane_a], box_a.normal[1][lane_a],
                               box_a.normal[2][lane_a]};
    const float normal_b[3] = {box_b.normal[0][lane_b], box_b.normal[1][lane_b],
                               box_b.normal[2][lane_b]};
    if (rows != 0)
      rows &= in_slab(a, normal_b, box_b.slab_low[lane_b] - slack, box_b.slab_high[lane_b] + slack);
    if (rows == 0) return;
    const std::uint32_t in_a =
        in_slab(b, normal_a, box_a.slab_low[lane_a] - slack, box_a.slab_high[lane_a] + slack);
    if (in_a == 0) return;
    bool near = false;
    const F d;
    // Coordinates are floats, and points of both blocks that matter are no further apart than this.
    const float blur = 1e-6f * (a.reach + b.reach) + search_.room, size = a.size + b.size;
    for (; rows != 0; rows &= rows - 1) {
      const auto i = static_cast<std::uint32_t>(std::countr_zero(rows));
      const OneBox box(a.low, a.high, i, search_.room);
      const std::uint32_t columns = in_a & meeting(b.low, b.high, box.low, box.high);
      if (columns == 0) continue;
      const auto over_a = hn::Set(d, blur * a.length[i] + a.slack[i] * size);
      const auto na = [&](int k) { return hn::Set(d, a.normal[k][i]); };
      for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
        std::uint32_t left = columns >> l & ((1u << hn::Lanes(d)) - 1);
        if (left == 0) continue;
        const auto plane_a = hn::Set(d, a.offset[i]);
        left &= straddling(over_a, [&](int c) {
          return ((na(0) * hn::Load(d, b.corner[c][0] + l) +
                   na(1) * hn::Load(d, b.corner[c][1] + l)) +
                  na(2) * hn::Load(d, b.corner[c][2] + l)) -
                 plane_a;
        });
        if (left == 0) continue;
        const auto over_b = hn::Set(d, blur) * hn::Load(d, b.length + l) +
                            hn::Load(d, b.slack + l) * hn::Set(d, size);
        const auto plane_b = hn::Load(d, b.offset + l);
        left &= straddling(over_b, [&](int c) {
          return ((hn::Load(d, b.normal[0] + l) * hn::Set(d, a.corner[c][0][i]) +
                   hn::Load(d, b.normal[1] + l) * hn::Set(d, a.corner[c][1][i])) +
                  hn::Load(d, b.normal[2] + l) * hn::Set(d, a.corner[c][2][i])) -
                 plane_b;
        });
        for (; left != 0; left &= left - 1) {
          near = true;
          add_pair(
              number_a, a, i, number_b, b,
              static_cast<std::uint32_t>(l) + static_cast<std::uint32_t>(std::countr_zero(left)));
        }
      }
    }
    if (near) {
      mark(scratch_.a.near, number_a);
      mark(scratch_.b.near, number_b);
    }
  }

  void add_pair(std::uint32_t number_a, const PlacedTriangles& a, std::uint32_t i,
                std::uint32_t number_b, const PlacedTriangles& b, std::uint32_t j) {
    TrianglePairs& pairs = *scratch_.pairs;
    const std::uint32_t n = pairs.count;
    const auto take = [&](int side, const MeshBlock& block, const PlacedTriangles& from,
                          std::uint32_t lane) {
      for (int c = 0; c < 3; ++c) {
        const std::uint32_t v = block.corner[c][lane];
        pairs.vertex[side][c][n] = block.vertex[v];
        for (int k = 0; k < 3; ++k) pairs.corner[side][c][k][n] = from.vertex[k][v];
      }
    };
    take(0, a_.blocks[number_a], a, i);
    take(1, b_.blocks[number_b], b, j);
    pairs.triangle[0][n] = kWidth * number_a + i;
    pairs.triangle[1][n] = kWidth * number_b + j;
    ++found_.tests;
    if (++pairs.count == 8) test_pairs();
  }

  /// A determinant of eight pairs: its value, how far it may be off, and bits of its sign.
  struct alignas(64) Heights {
    double value[3][8], error[3][8];
    std::uint32_t positive[3], certain[3];
  };

  using D = hn::CappedTag<double, 8>;
  using V = hn::Vec<D>;

  struct Vec3 {
    V x, y, z;
  };
  static HWY_INLINE Vec3 difference(const Vec3& a, const Vec3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  static HWY_INLINE void product(const Vec3& u, const Vec3& v, Vec3& normal, Vec3& size) {
    const V ax = u.y * v.z, bx = u.z * v.y, ay = u.z * v.x, by = u.x * v.z, az = u.x * v.y,
            bz = u.y * v.x;
    normal = {ax - bx, ay - by, az - bz};
    size = {hn::Abs(ax) + hn::Abs(bx), hn::Abs(ay) + hn::Abs(by), hn::Abs(az) + hn::Abs(bz)};
  }
  static HWY_INLINE V value_of(const Vec3& r, const Vec3& n) {
    return (r.x * n.x + r.y * n.y) + r.z * n.z;
  }
  static HWY_INLINE V error_of(const Vec3& r, const Vec3& size) {
    const D d;
    return hn::Set(d, exact::kFilter) *
           ((hn::Abs(r.x) * size.x + hn::Abs(r.y) * size.y) + hn::Abs(r.z) * size.z);
  }

  /// Tests what has been gathered by signs: in double, and what that leaves unclear exactly.
  void test_pairs() {
    TrianglePairs& pairs = *scratch_.pairs;
    const std::uint32_t count = pairs.count;
    pairs.count = 0;
    if (count == 0) return;
    const D d;
    Heights over_a = {}, over_b = {};         // B's corners over A's plane, A's over B's
    std::uint32_t round_positive[3][3] = {};  // [A's edge][B's edge]
    std::uint32_t round_certain[3][3] = {};
    for (std::size_t l = 0; l < count; l += hn::Lanes(d)) {
      Vec3 corner[2][3];
      for (int s = 0; s < 2; ++s)
        for (int c = 0; c < 3; ++c)
          corner[s][c] = {hn::Load(d, pairs.corner[s][c][0] + l),
                          hn::Load(d, pairs.corner[s][c][1] + l),
                          hn::Load(d, pairs.corner[s][c][2] + l)};
      const auto heights = [&](const Vec3(&plane)[3], const Vec3(&points)[3], Heights& out) {
        Vec3 normal, size;
        product(difference(plane[1], plane[0]), difference(plane[2], plane[0]), normal, size);
        for (int c = 0; c < 3; ++c) {
          const Vec3 r = difference(points[c], plane[0]);
          const V value = value_of(r, normal), error = error_of(r, size);
          hn::Store(value, d, out.value[c] + l);
          hn::Store(error, d, out.error[c] + l);
          out.positive[c] |= mask_bits(d, value > hn::Zero(d)) << l;
          out.certain[c] |= mask_bits(d, hn::Abs(value) > error) << l;
        }
      };
      heights(corner[0], corner[1], over_a);
      heights(corner[1], corner[0], over_b);
      Vec3 edge_b[3];
      for (int j = 0; j < 3; ++j) edge_b[j] = difference(corner[1][(j + 1) % 3], corner[1][j]);
      for (int i = 0; i < 3; ++i) {
        const Vec3 edge_a = difference(corner[0][(i + 1) % 3], corner[0][i]);
        for (int j = 0; j < 3; ++j) {
          Vec3 normal, size;
          product(edge_a, edge_b[j], normal, size);
          const Vec3 r = difference(corner[1][j], corner[0][i]);
          const V value = value_of(r, normal), error = error_of(r, size);
          round_positive[i][j] |= mask_bits(d, value > hn::Zero(d)) << l;
          round_certain[i][j] |= mask_bits(d, hn::Abs(value) > error) << l;
        }
      }
    }
    const std::uint32_t all = (1u << count) - 1;
    const auto alike = [](const std::uint32_t(&bits)[3]) {
      return (bits[0] & bits[1] & bits[2]) | ~(bits[0] | bits[1] | bits[2]);
    };
    const auto each = [](const std::uint32_t(&bits)[3]) { return bits[0] & bits[1] & bits[2]; };
    const std::uint32_t sure_a = each(over_a.certain), sure_b = each(over_b.certain);
    const std::uint32_t apart =
        (sure_a & alike(over_a.positive)) | (sure_b & alike(over_b.positive));
    std::uint32_t sure = sure_a & sure_b;
    for (int i = 0; i < 3; ++i) sure &= each(round_certain[i]);
    // Bits of pairs where an edge pierces the other triangle.
    std::uint32_t pierces_a[3], pierces_b[3], pierced = 0;
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t along_b[3] = {round_positive[0][k], round_positive[1][k],
                                        round_positive[2][k]};
      pierces_a[k] = (over_b.positive[k] ^ over_b.positive[(k + 1) % 3]) & alike(round_positive[k]);
      pierces_b[k] = (over_a.positive[k] ^ over_a.positive[(k + 1) % 3]) & alike(along_b);
      pierced |= pierces_a[k] | pierces_b[k];
    }
    for (std::uint32_t left = all & ~apart & (pierced | ~sure); left != 0; left &= left - 1) {
      const auto n = static_cast<std::uint32_t>(std::countr_zero(left));
      if (found_.crossings == scratch_.most_crossings) {
        found_.complete = false;
        return;
      }
      Crossing& out = scratch_.crossings[found_.crossings];
      const auto point = [&](int side, int c) -> exact::Point {
        const auto& x = pairs.corner[side][c];
        return {x[0][n], x[1][n], x[2][n]};
      };
      int ends = 0;
      if (sure >> n & 1) {
        const auto take = [&](const std::uint32_t(&pierces)[3], const Heights& heights, int side) {
          const auto end = [&](int c) -> exact::EdgeEnd {
            return {point(side, c), pairs.vertex[side][c][n], heights.value[c][n],
                    heights.error[c][n]};
          };
          for (int k = 0; k < 3; ++k)
            if (pierces[k] >> n & 1) {
              exact::place(exact::piercing(end(k), end((k + 1) % 3), k, side == 1),
                           heights.positive[k] >> n & 1 ? 1 : -1, out);
              ++ends;
            }
        };
        take(pierces_a, over_b, 0);
        take(pierces_b, over_a, 1);
      } else {
        Corners corners[2];
        for (int side = 0; side < 2; ++side)
          for (int c = 0; c < 3; ++c) {
            corners[side].x[c] = point(side, c);
            corners[side].vertex[c] = pairs.vertex[side][c][n];
          }
        ends = exact::cross_exactly(corners[0], corners[1], out);
      }
      if (ends == 0) continue;
      found_.consistent &= ends == 2;
      out.a = pairs.triangle[0][n];
      out.b = pairs.triangle[1][n];
      ++found_.crossings;
    }
  }

  const CrossingSearch& search_;
  const MeshTree& a_;
  const MeshTree& b_;
  ExactScratch& scratch_;
  float pad_a_, pad_b_, pad_a_here_, room_b_, scale_, turn_[9];
  std::uint32_t waiting_ = 0;
  CrossingsFound found_;
};

CrossingsFound search_crossings(const CrossingSearch& search, ExactScratch& scratch) {
  return Search(search, scratch).run();
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(search_crossings);

CrossingsFound find_crossings(const CrossingSearch& search, ExactScratch& scratch) noexcept {
  return HWY_DYNAMIC_DISPATCH(search_crossings)(search, scratch);
}

}  // namespace ist
#endif
