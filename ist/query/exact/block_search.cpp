#include "base/bits.h"
#include "query/exact/crossing_search.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/exact/block_search.cpp"
#include <hwy/foreach_target.h>

#include "query/exact/placed_mesh-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// Traverses both trees together, and collects the pairs of blocks whose boxes and slabs intersect.
class BlockSearch {
 public:
  BlockSearch(const CrossingSearch& search, ExactScratch& scratch)
      : search_(search),
        a_(*search.a),
        b_(*search.b),
        scratch_(scratch),
        placed_(search, scratch),
        pad_a_(pad(search.b_from_a, a_)),
        pad_b_(pad(search.a_from_b, b_)),
        room_b_(static_cast<float>(search.reach * search.b_from_a.scale)),
        scale_(static_cast<float>(search.a_from_b.scale) * (1 + kFloatError)),
        slack_(2 * pad_b_ + 2 * pad(Similarity::identity(), a_) + search.reach * 2) {
    for (int k = 0; k < 9; ++k)
      turn_[k] = static_cast<float>(search.a_from_b.m[k] / search.a_from_b.scale);
    // Nodes tile a surface.
    for (int k = 1; k <= a_.top; ++k)
      size_a_[k] = 1 / std::sqrt(static_cast<float>(a_.level[k].count));
    for (int k = 1; k <= b_.top; ++k)
      size_b_[k] = scale_ / std::sqrt(static_cast<float>(b_.level[k].count));
  }

  BlockPairs run() {
    push(a_.top, 0, b_.top, 0);
    while (waiting_ > 0 && found_.complete) {
      const BoxPair pair = scratch_.waiting[--waiting_];
      if (pair.level_a == 0)
        open_b(pair);
      else if (pair.level_b == 0)
        open_a(pair);
      else if (size_a_[pair.level_a] > kOpenedAlone * size_b_[pair.level_b])
        open_larger_a(pair);
      else if (size_b_[pair.level_b] > kOpenedAlone * size_a_[pair.level_a])
        open_larger_b(pair);
      else
        open_both(pair);
      if (++found_.visits == search_.max_visits && waiting_ > 0) found_.complete = false;
    }
    return found_;
  }

 private:
  void push(int level_a, std::uint32_t a, int level_b, std::uint32_t b) {
    if (level_a == 0 && level_b == 0) {
      if (found_.count == scratch_.most_pairs())
        found_.complete = false;
      else
        scratch_.keys[found_.count++] = std::uint64_t{a} << 32 | b;
    } else if (waiting_ == ExactScratch::kMostWaiting) {
      found_.complete = false;
    } else {
      scratch_.waiting[waiting_++] = {a, b, static_cast<std::uint8_t>(level_a),
                                      static_cast<std::uint8_t>(level_b)};
    }
  }

  /// The boxes of B that reach into the slab of a box of A, and whose own slab that box reaches
  /// into.
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
    std::uint32_t bits = 0;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      auto along = hn::Zero(d), reach = hn::Set(d, slack_);
      auto along_b = hn::Zero(d), reach_b = hn::Set(d, slack_);
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

  const PlacedBoxes& placed_a(int level, std::uint32_t i) {
    return placed_boxes(a_, level, i, search_.b_from_a, pad_a_, *scratch_.placed_a);
  }
  const PlacedBoxes& placed_b(int level, std::uint32_t i) {
    return placed_boxes(b_, level, i, search_.a_from_b, pad_b_, *scratch_.placed_b);
  }

  void open_both(const BoxPair& pair) {
    const BoxBlock& boxes_a = a_.level[pair.level_a].boxes[pair.a];
    const BoxBlock& boxes_b = b_.level[pair.level_b].boxes[pair.b];
    const PlacedBoxes& a_in_b = placed_a(pair.level_a, pair.a);
    const PlacedBoxes& b_in_a = placed_b(pair.level_b, pair.b);
    const OneBox all(b_in_a.all_low, b_in_a.all_high, search_.reach);
    // Unused lanes may intersect large boxes.
    std::uint32_t rows = meeting(boxes_a.low, boxes_a.high, all.low, all.high) &
                         ((1u << used_lanes(a_, pair.level_a, pair.a)) - 1);
    for (const std::uint32_t i : set_bits(rows)) {
      const OneBox here(boxes_a.low, boxes_a.high, i, search_.reach);
      std::uint32_t columns = meeting(b_in_a.low, b_in_a.high, here.low, here.high);
      if (columns == 0) continue;
      const OneBox there(a_in_b.low, a_in_b.high, i, room_b_);
      columns &= meeting(boxes_b.low, boxes_b.high, there.low, there.high);
      if (columns != 0) columns &= in_slabs(boxes_a, i, boxes_b, b_in_a);
      for (const std::uint32_t k : set_bits(columns))
        push(pair.level_a - 1, kWidth * pair.a + i, pair.level_b - 1, kWidth * pair.b + k);
    }
  }

  void open_larger_a(const BoxPair& pair) {
    const BoxBlock& boxes = a_.level[pair.level_a].boxes[pair.a];
    const PlacedBoxes& b_in_a = placed_b(pair.level_b, pair.b);
    const OneBox all(b_in_a.all_low, b_in_a.all_high, search_.reach);
    std::uint32_t found = meeting(boxes.low, boxes.high, all.low, all.high) &
                          ((1u << used_lanes(a_, pair.level_a, pair.a)) - 1);
    for (const std::uint32_t i : set_bits(found))
      push(pair.level_a - 1, kWidth * pair.a + i, pair.level_b, pair.b);
  }

  void open_larger_b(const BoxPair& pair) {
    const BoxBlock& boxes = b_.level[pair.level_b].boxes[pair.b];
    const PlacedBoxes& a_in_b = placed_a(pair.level_a, pair.a);
    const OneBox all(a_in_b.all_low, a_in_b.all_high, room_b_);
    std::uint32_t found = meeting(boxes.low, boxes.high, all.low, all.high) &
                          ((1u << used_lanes(b_, pair.level_b, pair.b)) - 1);
    for (const std::uint32_t i : set_bits(found))
      push(pair.level_a, pair.a, pair.level_b - 1, kWidth * pair.b + i);
  }

  /// True if a box intersects the box and the plane of one of a block's triangles. `half`: half of
  /// its sides, in A's frame.
  bool meets_triangle(const PlacedTriangles& block, const OneBox& box,
                      const float (&half)[3][3]) const {
    const std::uint32_t lanes = meeting(block.low, block.high, box.low, box.high);
    if (lanes == 0) return false;
    const F d;
    float middle[3], reach = 0, size = 0;
    for (int k = 0; k < 3; ++k) {
      middle[k] = 0.5f * (box.low[k] + box.high[k]);
      reach = std::max({reach, std::abs(box.low[k]), std::abs(box.high[k])});
      size += box.high[k] - box.low[k];
    }
    const auto blur = hn::Set(d, 1e-6f * (block.reach + reach) + slack_);
    std::uint32_t bits = 0;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      hn::Vec<F> n[3];
      for (int k = 0; k < 3; ++k) n[k] = hn::Load(d, block.normal[k] + l);
      const auto along = [&](const float(&x)[3]) {
        return (n[0] * hn::Set(d, x[0]) + n[1] * hn::Set(d, x[1])) + n[2] * hn::Set(d, x[2]);
      };
      const auto height = hn::Abs(along(middle) - hn::Load(d, block.offset + l));
      const auto over = blur * hn::Load(d, block.length + l) +
                        hn::Load(d, block.slack + l) * hn::Set(d, block.size + size);
      const auto out =
          (hn::Abs(along(half[0])) + hn::Abs(along(half[1]))) + (hn::Abs(along(half[2])) + over);
      bits |= mask_bits(d, height <= out) << l;
    }
    return (lanes & bits) != 0;
  }

  /// A's node is a block, whose triangles may be far larger than B's boxes.
  void open_b(const BoxPair& pair) {
    const std::uint32_t lane = pair.a % kWidth, parent = pair.a / kWidth;
    const OneBox here(a_.level[1].boxes[parent].low, a_.level[1].boxes[parent].high, lane,
                      search_.reach);
    const PlacedBoxes& b_in_a = placed_b(pair.level_b, pair.b);
    const BoxBlock& boxes = b_.level[pair.level_b].boxes[pair.b];
    std::uint32_t found = meeting(b_in_a.low, b_in_a.high, here.low, here.high);
    if (found == 0) return;
    const PlacedTriangles& block = placed_.triangles(false, pair.a);
    for (const std::uint32_t i : set_bits(found)) {
      float half[3][3];
      for (int side = 0; side < 3; ++side)
        for (int k = 0; k < 3; ++k)
          half[side][k] =
              turn_[3 * k + side] * scale_ * 0.5f * (boxes.high[side][i] - boxes.low[side][i]);
      if (meets_triangle(block, OneBox(b_in_a.low, b_in_a.high, i, search_.reach), half))
        push(0, pair.a, pair.level_b - 1, kWidth * pair.b + i);
    }
  }

  void open_a(const BoxPair& pair) {
    const PlacedBoxes& b_in_a = placed_b(1, pair.b / kWidth);
    const OneBox there(b_in_a.low, b_in_a.high, pair.b % kWidth, search_.reach);
    const BoxBlock& boxes = a_.level[pair.level_a].boxes[pair.a];
    std::uint32_t found = meeting(boxes.low, boxes.high, there.low, there.high) &
                          ((1u << used_lanes(a_, pair.level_a, pair.a)) - 1);
    if (found == 0) return;
    const PlacedTriangles& block = placed_.triangles(true, pair.b);
    for (const std::uint32_t i : set_bits(found)) {
      float half[3][3] = {};
      for (int k = 0; k < 3; ++k) half[k][k] = 0.5f * (boxes.high[k][i] - boxes.low[k][i]);
      if (meets_triangle(block, OneBox(boxes.low, boxes.high, i, search_.reach), half))
        push(pair.level_a - 1, kWidth * pair.a + i, 0, pair.b);
    }
  }

  const CrossingSearch& search_;
  const MeshTree& a_;
  const MeshTree& b_;
  ExactScratch& scratch_;
  PlacedMeshes placed_;
  float pad_a_, pad_b_, room_b_, scale_, slack_, turn_[9];
  float size_a_[kMaxLevels], size_b_[kMaxLevels];  ///< of a level's nodes
  std::uint32_t waiting_ = 0;
  BlockPairs found_;
};

BlockPairs search_blocks(const CrossingSearch& search, ExactScratch& scratch) {
  return BlockSearch(search, scratch).run();
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(search_blocks);

BlockPairs find_block_pairs(const CrossingSearch& search, ExactScratch& scratch) noexcept {
  return HWY_DYNAMIC_DISPATCH(search_blocks)(search, scratch);
}

}  // namespace ist
#endif
