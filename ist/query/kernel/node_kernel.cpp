#include "query/kernel/node_kernel.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/kernel/node_kernel.cpp"
#include <hwy/foreach_target.h>

#include "query/kernel/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// Appends the pairs of the chosen lanes and y to two lists, which have a spare vector at the end.
template <class T, class M>
HWY_INLINE std::size_t append(LaneTag<T> d, M chosen, std::uint32_t first, std::uint32_t y,
                              std::uint32_t* out_x, std::uint32_t* out_y) {
  const hn::CappedTag<std::uint32_t, kWidth> du;
  for (std::size_t i = 0; i < hn::Lanes(d); i += hn::Lanes(du))
    hn::StoreU(hn::Set(du, y), du, out_y + i);
  return append_lanes<T>(d, chosen, first, out_x);
}

/// The ball of node y of each pair, relative to the origin of the block that is opened.
template <class T>
struct alignas(64) FixedBalls {
  T x[kNodePairs], y[kNodePairs], z[kNodePairs];
  T reach[kNodePairs];   ///< radius plus the rounding of distances
  T within[kNodePairs];  ///< radius less that rounding
};

/// Gathers the balls pair by pair and maps them a vector at a time.
template <class T>
HWY_INLINE void place_fixed(const NodeStage& stage, const std::uint32_t* x, const std::uint32_t* y,
                            std::size_t n, FixedBalls<T>& fixed) {
  const hn::CappedTag<double, 8> d;
  using V = hn::Vec<decltype(d)>;
  alignas(64) double centre[3][kNodePairs];
  alignas(64) double radius[kNodePairs];
  alignas(64) double origin[3][kNodePairs];
  const SphereTree::Level& opened = stage.x->level[stage.level_x];
  for (std::size_t i = 0; i < n; ++i) {
    const NodeBall ball = stage.y->ball(stage.level_y, y[i]);
    const Origin& o = opened.origins[x[i]];
    centre[0][i] = ball.centre[0], centre[1][i] = ball.centre[1], centre[2][i] = ball.centre[2];
    radius[i] = ball.r;
    origin[0][i] = o.x, origin[1][i] = o.y, origin[2][i] = o.z;
  }
  const Similarity& map = *stage.x_from_y;
  const V scale = hn::Set(d, map.scale);
  for (std::size_t i = 0; i < n; i += hn::Lanes(d)) {
    const auto pairs = hn::FirstN(d, n - i);  // others are uninitialised
    const V cx = hn::MaskedLoad(pairs, d, centre[0] + i);
    const V cy = hn::MaskedLoad(pairs, d, centre[1] + i);
    const V cz = hn::MaskedLoad(pairs, d, centre[2] + i);
    const V r = hn::MaskedLoad(pairs, d, radius + i) * scale;
    V q[3];
    V magnitude = r;
    for (int k = 0; k < 3; ++k) {
      const V moved = ((hn::Set(d, map.m[3 * k]) * cx + hn::Set(d, map.m[3 * k + 1]) * cy) +
                       hn::Set(d, map.m[3 * k + 2]) * cz) +
                      hn::Set(d, map.t[k]);
      q[k] = moved - hn::MaskedLoad(pairs, d, origin[k] + i);
      magnitude = magnitude + hn::Abs(q[k]);
    }
    const V error = magnitude * hn::Set(d, distance_error<T>(2));
    store_as(q[0], d, fixed.x + i);
    store_as(q[1], d, fixed.y + i);
    store_as(q[2], d, fixed.z + i);
    store_as(r + error, d, fixed.reach + i);
    store_as(r - error, d, fixed.within + i);
  }
}

/// The mask of the children [lane, …) of a block that reach fixed ball i. `d2`: their squared
/// distances; `r`: upper bounds on their radii.
template <class T, class V = hn::Vec<LaneTag<T>>>
HWY_INLINE hn::Mask<LaneTag<T>> near_of(const BallBlock& block, std::size_t lane,
                                        const FixedBalls<T>& fixed, std::size_t i, V& d2, V& r) {
  const LaneTag<T> d;
  const V dx = load_as<T>(d, block.x + lane) - hn::Set(d, fixed.x[i]);
  const V dy = load_as<T>(d, block.y + lane) - hn::Set(d, fixed.y[i]);
  const V dz = load_as<T>(d, block.z + lane) - hn::Set(d, fixed.z[i]);
  d2 = (dx * dx + dy * dy) + dz * dz;
  r = load_as<T>(d, block.r + lane) * hn::Set(d, static_cast<T>(1 + distance_error<T>(1)));
  // Unused lanes have negative radii, whose squares must not count.
  const V sum = hn::Max(r + hn::Set(d, fixed.reach[i]), hn::Zero(d));
  return d2 < sum * sum;
}

/// kContained: children inside of y[i] go to `contained`.
template <class T, bool kContained>
HWY_INLINE std::size_t open_as(const NodeStage& stage, const std::uint32_t* x,
                               const std::uint32_t* y, std::size_t n, std::uint32_t* out_x,
                               std::uint32_t* out_y, ContainedNodes* contained) {
  const LaneTag<T> d;
  const SphereTree::Level& opened = stage.x->level[stage.level_x];
  FixedBalls<T> fixed;
  place_fixed(stage, x, y, n, fixed);
  std::size_t found = 0;
  const std::uint32_t below = stage.x->count(stage.level_x - 1);
  for (std::size_t i = 0; i < n; ++i) {
    const BallBlock& block = opened.blocks[x[i]];
    const std::uint32_t first_child = kWidth * x[i];
    for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
      hn::Vec<LaneTag<T>> d2, r;
      auto near = near_of(block, lane, fixed, i, d2, r);
      const std::uint32_t child = first_child + static_cast<std::uint32_t>(lane);
      if constexpr (kContained) {
        // Computed for near lanes only: the square of an unused one may overflow.
        const auto spare =
            hn::IfThenElseZero(near, hn::Max(hn::Set(d, fixed.within[i]) - r, hn::Zero(d)));
        const auto inside = d2 < spare * spare;
        contained->size += append<T>(d, inside, child, y[i], contained->x + contained->size,
                                     contained->y + contained->size);
        near = hn::AndNot(inside, near);
      }
      found += append<T>(d, near, child, y[i], out_x + found, out_y + found);
    }
    // A large enough ball reaches unused lanes too.
    while (found > 0 && out_x[found - 1] >= below) --found;
    if constexpr (kContained)
      while (contained->size > 0 && contained->x[contained->size - 1] >= below) --contained->size;
  }
  return found;
}

std::size_t open(const NodeStage& stage, const std::uint32_t* x, const std::uint32_t* y,
                 std::size_t n, std::uint32_t* out_x, std::uint32_t* out_y,
                 ContainedNodes* contained) {
  if (stage.precision == Precision::float32)
    return contained == nullptr ? open_as<float, false>(stage, x, y, n, out_x, out_y, contained)
                                : open_as<float, true>(stage, x, y, n, out_x, out_y, contained);
  return contained == nullptr ? open_as<double, false>(stage, x, y, n, out_x, out_y, contained)
                              : open_as<double, true>(stage, x, y, n, out_x, out_y, contained);
}

void sum_subtrees(const SphereTree& tree, int level, const std::uint32_t* nodes, std::size_t n,
                  SubtreeSums& sums) {
  const LaneTag<double> d;
  const SphereTree::Level& leaves = tree.level[0];
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    auto cubes = hn::Load(d, sums.cubes + lane);
    auto x = hn::Load(d, sums.moment[0] + lane);
    auto y = hn::Load(d, sums.moment[1] + lane);
    auto z = hn::Load(d, sums.moment[2] + lane);
    for (std::size_t i = 0; i < n; ++i) {
      const SphereTree::Leaves below = tree.leaves_below(level, nodes[i]);
      for (std::uint32_t b = below.begin; b < below.end; ++b) {
        const BallBlock& balls = leaves.blocks[b];
        const Origin& origin = leaves.origins[b];
        // Unused lanes have negative radii.
        const auto r = hn::Max(load_as<double>(d, balls.r + lane), hn::Zero(d));
        const auto cube = r * (r * r);
        cubes = cubes + cube;
        x = x + cube * (load_as<double>(d, balls.x + lane) + hn::Set(d, origin.x));
        y = y + cube * (load_as<double>(d, balls.y + lane) + hn::Set(d, origin.y));
        z = z + cube * (load_as<double>(d, balls.z + lane) + hn::Set(d, origin.z));
      }
    }
    hn::Store(cubes, d, sums.cubes + lane);
    hn::Store(x, d, sums.moment[0] + lane);
    hn::Store(y, d, sums.moment[1] + lane);
    hn::Store(z, d, sums.moment[2] + lane);
  }
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(open);
HWY_EXPORT(sum_subtrees);

std::size_t open_nodes(const NodeStage& stage, const std::uint32_t* x, const std::uint32_t* y,
                       std::size_t n, std::uint32_t* out_x, std::uint32_t* out_y,
                       ContainedNodes* contained) noexcept {
  return HWY_DYNAMIC_DISPATCH(open)(stage, x, y, n, out_x, out_y, contained);
}

void add_subtrees(const SphereTree& tree, int level, const std::uint32_t* nodes, std::size_t n,
                  SubtreeSums& sums) noexcept {
  if (n == 0) return;
  HWY_DYNAMIC_DISPATCH(sum_subtrees)(tree, level, nodes, n, sums);
  for (std::size_t i = 0; i < n; ++i) {
    const SphereTree::Leaves below = tree.leaves_below(level, nodes[i]);
    sums.spheres += std::min(kWidth * below.end, tree.header->sphere_count) - kWidth * below.begin;
  }
}

}  // namespace ist
#endif
