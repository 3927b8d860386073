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
    const V squares = (q0 * q0 + q1 * q1) + (q2 * q2 + q3 * q3);
    Mask placed = squares == constant(1);
    V w = q0;
    Vec3 v = {q1, q2, q3};
    if (!hn::AllTrue(d, placed)) {  // bodies without a rotation skip this
      const V norm = hn::Sqrt(squares);
      placed = hn::And(norm >= constant(kShortestDirection), norm <= constant(kLongestDirection));
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

/// As BodyBlock::set_pose() of each: four numbers of four bodies at a time.
HWY_INLINE void set_poses(const Pose* poses, BodyBlock& block) {
#if HWY_MAX_BYTES < 32
  for (std::size_t k = 0; k < BodyBlock::kCount; ++k) block.set_pose(k, poses[k]);
#else
  const hn::CappedTag<double, 4> d;
  for (const std::size_t first : {0, 3})
    for (std::size_t i = 0; i < BodyBlock::kCount; i += 4) {
      const auto row = [&](std::size_t k) HWY_ATTR {
        return hn::LoadU(d, reinterpret_cast<const double*>(poses + i + k) + first);
      };
      const auto column = [&](std::size_t c, hn::Vec<decltype(d)> v) HWY_ATTR {
        hn::StoreU(v, d, (first + c < 4 ? block.q[first + c] : block.t[first + c - 4]) + i);
      };
      const auto r0 = row(0), r1 = row(1), r2 = row(2), r3 = row(3);
      const auto even_01 = hn::InterleaveLower(d, r0, r1), odd_01 = hn::InterleaveUpper(d, r0, r1);
      const auto even_23 = hn::InterleaveLower(d, r2, r3), odd_23 = hn::InterleaveUpper(d, r2, r3);
      column(0, hn::ConcatLowerLower(d, even_23, even_01));
      column(1, hn::ConcatLowerLower(d, odd_23, odd_01));
      column(2, hn::ConcatUpperUpper(d, even_23, even_01));
      column(3, hn::ConcatUpperUpper(d, odd_23, odd_01));
    }
#endif
}

HWY_ATTR bool put_all(const Pose* poses, BodyBlock& block, const std::uint32_t* lane_of,
                      BoxNode* nodes) {
  // Blocks come in a row.
  constexpr std::size_t kAhead = 4, kLine = 64;
  for (std::size_t i = 0; i < BodyBlock::kCount * sizeof(Pose); i += kLine)
    __builtin_prefetch(reinterpret_cast<const char*>(poses + kAhead * BodyBlock::kCount) + i);
  for (std::size_t i = 0; i < sizeof(BodyBlock); i += kLine)
    __builtin_prefetch(reinterpret_cast<const char*>(&block + kAhead) + i);
  set_poses(poses, block);
  BlockBoxes boxes;
  place_all(block, 0xff, boxes);
  if (boxes.placed != 0xff) return false;
#pragma GCC unroll 8
  for (std::size_t k = 0; k < BodyBlock::kCount; ++k) {
    BoxNode& node = nodes[lane_of[k] / BoxNode::kLanes];
    const std::uint32_t lane = lane_of[k] % BoxNode::kLanes;
    for (std::size_t c = 0; c < 3; ++c) {
      node.low[c][lane] = boxes.low[c][k];
      node.high[c][lane] = boxes.high[c][k];
    }
  }
  return true;
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

/// Lanes of nodes whose boxes meet that of a leaf, and the leaf: its bodies are looked at later,
/// many such pairs in a row, so that no branch depends on how many there are of each.
struct NearLeaves {
  static constexpr std::size_t kCapacity = 64;

  /// Bits of the lanes of `node`.
  HWY_INLINE void add(std::uint32_t leaf, std::uint32_t node, std::uint32_t lanes) {
    const hn::CappedTag<std::uint32_t, BoxNode::kLanes> d;
    const hn::Rebind<std::uint8_t, decltype(d)> d8;
    for (std::size_t i = 0; i < BoxNode::kLanes; i += hn::Lanes(d)) {
      const auto lane = hn::PromoteTo(d, hn::LoadU(d8, kSetBits[lanes].data() + i));
      hn::StoreU(lane + hn::Set(d, BoxNode::kLanes * node), d, lane_of + count + i);
      hn::StoreU(hn::Set(d, leaf), d, leaf_of + count + i);
    }
    count += static_cast<std::size_t>(count_bits(lanes));
  }

  std::size_t count = 0;
  std::uint32_t leaf_of[kCapacity + BoxNode::kLanes], lane_of[kCapacity + BoxNode::kLanes];
};

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
  NearLeaves near;
  const auto look = [&]() HWY_ATTR {
    for (std::size_t n = 0; n < near.count; ++n) {
      const BoxNode &a = search.a[near.leaf_of[n]], &b = search.b[near.lane_of[n] / kLanes];
      const std::uint32_t k = near.lane_of[n] % kLanes;
      for (const std::uint32_t i : set_bits(meeting(a, b, k)))
        out[count++] = {a.child[i], b.child[k]};
    }
    near.count = 0;
  };
  // (64 pairs are the most of two nodes)
  while (count + 64 + kLanes * (NearLeaves::kCapacity + kLanes) <= PairSearch::kMost) {
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
    const BoxNode &a = search.a[two.a], &b = search.b[two.b];
    std::uint32_t i = 0, j = 0, child_a = 0, child_b = 0;
    std::uint64_t left = two.left;
    bool of_leaves = true;
    for (; left != 0 && of_leaves && near.count <= NearLeaves::kCapacity; left &= left - 1) {
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(left));
      i = bit / kLanes, j = bit % kLanes;
      child_a = a.child[i], child_b = b.child[j];
      of_leaves = !a.is_body(i) && !b.is_body(j) && search.a[child_a].is_leaf() &&
                  search.b[child_b].is_leaf();
      if (of_leaves) near.add(child_a, child_b, meeting(search.b[child_b], a, i));
    }
    two.left = left;
    if (near.count > NearLeaves::kCapacity) look();
    if (of_leaves) {
      search.depth -= left == 0;
    } else if (a.is_body(i)) {
      between(two.a, 1u << i, child_b, 0);
    } else if (b.is_body(j)) {
      between(child_a, meeting(search.a[child_a], b, j), two.b, 1u << j);
    } else {
      between(child_a, meeting(search.a[child_a], b, j), child_b, 0);
    }
  }
  look();
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
HWY_EXPORT(put_all);
HWY_EXPORT(next_of);
HWY_EXPORT(refit_all);

void place_boxes(const BodyBlock& block, std::uint32_t lanes, BlockBoxes& boxes) noexcept {
  HWY_DYNAMIC_DISPATCH(place_all)(block, lanes, boxes);
}

bool put_poses(const Pose* poses, BodyBlock& block, const std::uint32_t* lane_of,
               BoxNode* nodes) noexcept {
  return HWY_DYNAMIC_DISPATCH(put_all)(poses, block, lane_of, nodes);
}
std::size_t next_pairs(PairSearch& search, BodyPair* out) noexcept {
  return HWY_DYNAMIC_DISPATCH(next_of)(search, out);
}
double refit_nodes(std::span<BoxNode> nodes) noexcept {
  return HWY_DYNAMIC_DISPATCH(refit_all)(nodes);
}

}  // namespace ist
#endif
