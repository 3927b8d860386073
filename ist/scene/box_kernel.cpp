#include "base/bits.h"
#include "scene/body_box.h"
#include "scene/box_tree.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "scene/box_kernel.cpp"
#include <hwy/foreach_target.h>

#include "query/base/solid_box.h"
#include "query/exact/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

#define IST_FORMULA HWY_INLINE
#include "query/base/rotation_formulas-inl.h"
#undef IST_FORMULA

HWY_INLINE Vec3 load(const double (&from)[3][BodyBlock::kCount], std::size_t i) {
  const D d;
  return {hn::LoadU(d, from[0] + i), hn::LoadU(d, from[1] + i), hn::LoadU(d, from[2] + i)};
}

/// Vector version of float_below().
HWY_INLINE hn::Vec<hn::Rebind<float, D>> float_below(V x) {
  const hn::Rebind<float, D> df;
  const auto nearest = hn::DemoteTo(df, x);
  return nearest - hn::Abs(nearest) * hn::Set(df, 1.2e-7f) - hn::Set(df, 1e-37f);
}

HWY_ATTR void place_all(const BodyBlock& block, std::uint32_t lanes, BlockBoxes& boxes) {
  const D d;
  const hn::Rebind<float, D> df;
  boxes.placed = 0;
  for (std::size_t i = 0; i < BodyBlock::kCount; i += hn::Lanes(d)) {
    if ((lanes >> i & ((1u << hn::Lanes(d)) - 1)) == 0) continue;
    const V q0 = hn::LoadU(d, block.q[0] + i), q1 = hn::LoadU(d, block.q[1] + i),
            q2 = hn::LoadU(d, block.q[2] + i), q3 = hn::LoadU(d, block.q[3] + i);
    const V norm = hn::Sqrt((q0 * q0 + q1 * q1) + (q2 * q2 + q3 * q3));
    Mask placed =
        hn::And(norm >= constant(kShortestDirection), norm <= constant(kLongestDirection));
    V w = q0;
    Vec3 v = {q1, q2, q3};
    if (!hn::AllTrue(d, norm == constant(1))) {  // bodies without a rotation skip this
      // (no lane divides by zero, or overflows)
      const V by = hn::IfThenElse(placed, norm, constant(1));
      const auto unit = [&](V q) { return hn::IfThenElseZero(placed, q) / by; };
      w = unit(q0);
      v = {unit(q1), unit(q2), unit(q3)};
    }
    Vec3 low, high;
    box_around(w, v, load(block.t, i), load(block.middle, i), load(block.half, i),
               hn::LoadU(d, block.wider + i), low, high);
    const V most = constant(WorldBox::kMost);
    for (const V x : {low.x, low.y, low.z}) placed = hn::And(placed, x >= hn::Neg(most));
    for (const V x : {high.x, high.y, high.z}) placed = hn::And(placed, x <= most);
    const V lows[3] = {low.x, low.y, low.z}, highs[3] = {high.x, high.y, high.z};
    for (int k = 0; k < 3; ++k) {
      hn::StoreU(float_below(hn::IfThenElseZero(placed, lows[k])), df, boxes.low[k] + i);
      hn::StoreU(hn::Neg(float_below(hn::Neg(hn::IfThenElseZero(placed, highs[k])))), df,
                 boxes.high[k] + i);
    }
    boxes.placed |= mask_bits(d, placed) << i;
  }
}

using Floats = hn::CappedTag<float, BoxNode::kLanes>;

HWY_INLINE std::uint32_t bits_of(hn::Mask<Floats> mask) {
  std::uint8_t bits[8];
  hn::StoreMaskBits(Floats(), mask, bits);
  return bits[0];
}

/// A bit for each lane whose box meets that of a lane of another node.
HWY_INLINE std::uint32_t meeting(const BoxNode& node, const BoxNode& of, std::uint32_t k) {
  const Floats d;
  std::uint32_t out = 0;
  for (std::size_t i = 0; i < BoxNode::kLanes; i += hn::Lanes(d)) {
    const auto meet = [&](int c) HWY_ATTR {
      return hn::And(hn::Load(d, node.low[c] + i) <= hn::Set(d, of.high[c][k]),
                     hn::Load(d, node.high[c] + i) >= hn::Set(d, of.low[c][k]));
    };
    out |= bits_of(hn::And(hn::And(meet(0), meet(1)), meet(2))) << i;
  }
  return out;
}

HWY_ATTR std::size_t next_of(PairSearch& search, BodyPair* out) {
  constexpr std::uint32_t kLanes = BoxNode::kLanes;
  std::size_t count = 0;
  const auto leave = [&](std::uint32_t a, std::uint32_t b, std::uint64_t left) HWY_ATTR {
    if (left != 0) search.stack[search.depth++] = {a, b, left};
  };
  const auto within = [&](std::uint32_t at) HWY_ATTR {
    const BoxNode& node = search.a[at];
    std::uint64_t found = 0, left = 0;
    for (std::uint32_t k = 0; k < kLanes - 1; ++k)
      found |= std::uint64_t{meeting(node, node, k) & (0xfeu << k)} << kLanes * k;
    for (const std::uint32_t bit : set_bits(found)) {
      if (node.is_body(bit / kLanes) && node.is_body(bit % kLanes))
        out[count++] = {node.child[bit / kLanes], node.child[bit % kLanes]};
      else
        left |= std::uint64_t{1} << bit;
    }
    leave(at, at, left);
  };
  // Lanes of one node and all of another; or, if that is known, this one.
  const auto between = [&](std::uint32_t at_a, std::uint32_t lanes, std::uint32_t at_b,
                           std::uint32_t only) HWY_ATTR {
    const BoxNode &a = search.a[at_a], &b = search.b[at_b];
    std::uint64_t left = 0;
    for (const std::uint32_t k : set_bits(lanes)) {
      std::uint32_t row = only != 0 ? only : meeting(b, a, k);
      if (a.is_body(k)) {
        for (const std::uint32_t i : set_bits(row & b.bodies))
          out[count++] = {a.child[k], b.child[i]};
        row &= ~b.bodies;
      }
      left |= std::uint64_t{row} << kLanes * k;
    }
    leave(at_a, at_b, left);
  };
  // (64 pairs are the most of two nodes)
  while (count + 64 <= PairSearch::kMost) {
    if (search.depth == 0) {
      if (search.next == search.end) break;
      const std::uint32_t at = search.next++;
      if (search.a == search.b)
        within(at);
      else
        between(search.root_a, search.a[search.root_a].used, search.root_b, 0);
      continue;
    }
    LanePairs& two = search.stack[search.depth - 1];
    if (two.left == 0) {
      --search.depth;
      continue;
    }
    const auto bit = static_cast<std::uint32_t>(std::countr_zero(two.left));
    two.left &= two.left - 1;
    const std::uint32_t i = bit / kLanes, j = bit % kLanes;
    const BoxNode &a = search.a[two.a], &b = search.b[two.b];
    const std::uint32_t child_a = a.child[i], child_b = b.child[j];
    if (a.is_body(i))
      between(two.a, 1u << i, child_b, 0);
    else if (b.is_body(j))
      between(child_a, meeting(search.a[child_a], b, j), two.b, 1u << j);
    else
      between(child_a, meeting(search.a[child_a], b, j), child_b, 0);
  }
  return count;
}

HWY_ATTR double refit_all(std::span<BoxNode> nodes) {
  const Floats d;
  double area = 0;
  for (std::size_t i = nodes.size(); i-- > 0;) {
    const BoxNode& node = nodes[i];
    SceneBox box;
    for (std::size_t c = 0; c < 3; ++c) {
      auto low = hn::Load(d, node.low[c]), high = hn::Load(d, node.high[c]);
      for (std::size_t k = hn::Lanes(d); k < BoxNode::kLanes; k += hn::Lanes(d)) {
        low = hn::Min(low, hn::Load(d, node.low[c] + k));
        high = hn::Max(high, hn::Load(d, node.high[c] + k));
      }
      box.low[c] = hn::GetLane(hn::MinOfLanes(d, low));
      box.high[c] = hn::GetLane(hn::MaxOfLanes(d, high));
    }
    area += box.area();
    if (node.parent != BoxNode::kNone) nodes[node.parent].set(node.place, box);
  }
  return area;
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(place_all);
HWY_EXPORT(next_of);
HWY_EXPORT(refit_all);

void place_boxes(const BodyBlock& block, std::uint32_t lanes, BlockBoxes& boxes) noexcept {
  HWY_DYNAMIC_DISPATCH(place_all)(block, lanes, boxes);
}

std::size_t next_pairs(PairSearch& search, BodyPair* out) noexcept {
  return HWY_DYNAMIC_DISPATCH(next_of)(search, out);
}
double refit_nodes(std::span<BoxNode> nodes) noexcept {
  return HWY_DYNAMIC_DISPATCH(refit_all)(nodes);
}

}  // namespace ist
#endif
