#include "scene/box_tree.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "scene/tree_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, BoxNode::kLanes>;

/// A bit for each lane whose box meets that of a lane of another node.
HWY_INLINE std::uint32_t meeting(const BoxNode& node, const BoxNode& of, std::uint32_t k) {
  const D d;
  std::uint32_t out = 0;
  for (std::size_t i = 0; i < BoxNode::kLanes; i += hn::Lanes(d)) {
    const auto meet = [&](int c) {
      return hn::And(hn::Load(d, node.low[c] + i) <= hn::Set(d, of.high[c][k]),
                     hn::Load(d, node.high[c] + i) >= hn::Set(d, of.low[c][k]));
    };
    std::uint8_t bits[8];
    hn::StoreMaskBits(d, hn::And(hn::And(meet(0), meet(1)), meet(2)), bits);
    out |= static_cast<std::uint32_t>(bits[0]) << i;
  }
  return out;
}

HWY_ATTR std::size_t next_of(PairSearch& search, BodyPair* out) {
  std::size_t count = 0;
  // Lanes of one node and of another; of these one lane alone, or all. At most 64 pairs.
  const auto enter = [&](std::uint32_t at_a, std::uint32_t lanes, std::uint32_t at_b,
                         std::uint32_t only) HWY_ATTR {
    const BoxNode &a = search.a[at_a], &b = search.b[at_b];
    const bool same = &a == &b;
    std::uint64_t left = 0;
    for (; lanes != 0; lanes &= lanes - 1) {
      const auto k = static_cast<std::uint32_t>(std::countr_zero(lanes));
      std::uint32_t row = only != 0 ? only : meeting(b, a, k);
      if (same) row &= ~((2u << k) - 1);
      if (a.is_body(k)) {
        for (std::uint32_t bits = row & b.bodies; bits != 0; bits &= bits - 1)
          out[count++] = {a.child[k], b.child[std::countr_zero(bits)]};
        row &= ~b.bodies;
      } else if (same) {
        row |= 1u << k;
      }
      left |= static_cast<std::uint64_t>(row) << BoxNode::kLanes * k;
    }
    if (left != 0) search.stack[search.depth++] = {at_a, at_b, left};
  };
  if (!search.begun) {
    search.begun = true;
    enter(search.root_a, search.a[search.root_a].used, search.root_b, 0);
  }
  while (search.depth > 0 && count + 64 <= PairSearch::kMost) {
    NodePair& two = search.stack[search.depth - 1];
    if (two.left == 0) {
      --search.depth;
      continue;
    }
    const auto bit = static_cast<std::uint32_t>(std::countr_zero(two.left));
    two.left &= two.left - 1;
    const std::uint32_t i = bit / BoxNode::kLanes, j = bit % BoxNode::kLanes;
    const BoxNode &a = search.a[two.a], &b = search.b[two.b];
    if (a.is_body(i)) {
      enter(two.a, 1u << i, b.child[j], 0);
    } else if (b.is_body(j)) {
      enter(a.child[i], meeting(search.a[a.child[i]], b, j), two.b, 1u << j);
    } else {
      const BoxNode& below = search.a[a.child[i]];
      const bool same = &below == &search.b[b.child[j]];
      enter(a.child[i], same ? below.used : meeting(below, b, j), b.child[j], 0);
    }
  }
  return count;
}

HWY_ATTR double refit_all(std::span<BoxNode> nodes) {
  const D d;
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

HWY_EXPORT(next_of);
HWY_EXPORT(refit_all);

std::size_t next_pairs(PairSearch& search, BodyPair* out) noexcept {
  return HWY_DYNAMIC_DISPATCH(next_of)(search, out);
}
double refit_nodes(std::span<BoxNode> nodes) noexcept {
  return HWY_DYNAMIC_DISPATCH(refit_all)(nodes);
}

}  // namespace ist
#endif
