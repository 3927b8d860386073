#include "query/kernel/gap_kernel.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/kernel/gap_kernel.cpp"
#include <hwy/foreach_target.h>

#include "base/bits.h"
#include "query/kernel/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// At most half of the lanes: each step of the traversal waits for the one before, and the latency
/// of roots grows with the length of vectors.
template <class T>
using GapTag = hn::CappedTag<T, kWidth / 2>;

template <class T>
struct alignas(64) Gaps {
  T gap[kWidth];
  T cover[kWidth];
};

template <class T>
HWY_INLINE void child_gaps_as(const GapSide& side, TreeNode x, TreeNode y, Gaps<T>& out) {
  const GapTag<T> d;
  const SphereTree::Level& level = side.x->level[x.level];
  const BallBlock& block = level.blocks[x.block];
  const Origin& origin = level.origins[x.block];
  const float* covers = x.level == 0 ? side.x->sphere_cover + std::size_t{kWidth} * x.block
                                     : level.nodes[x.block].cover;
  const NodeBall ball = side.y->ball(y);
  double q[3];
  side.x_from_y->apply(ball.centre, q);
  const auto qx = hn::Set(d, static_cast<T>(q[0] - origin.x));
  const auto qy = hn::Set(d, static_cast<T>(q[1] - origin.y));
  const auto qz = hn::Set(d, static_cast<T>(q[2] - origin.z));
  const double scale = side.x_from_y->scale;
  const auto radius = hn::Set(d, static_cast<T>(ball.r * scale));
  const auto cover = hn::Set(d, static_cast<T>(side.y->cover(y.level, y.block) * scale));
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const auto dx = load_as<T>(d, block.x + lane) - qx;
    const auto dy = load_as<T>(d, block.y + lane) - qy;
    const auto dz = load_as<T>(d, block.z + lane) - qz;
    const auto distance = hn::Sqrt((dx * dx + dy * dy) + dz * dz);
    hn::Store((distance - load_as<T>(d, block.r + lane)) - radius, d, out.gap + lane);
    hn::Store((distance - load_as<T>(d, covers + lane)) - cover, d, out.cover + lane);
  }
}

/// A bit for each lane that is below one of the limits.
template <class T>
HWY_INLINE std::uint32_t nearer(const Gaps<T>& gaps, T gap_limit, T cover_limit) {
  const GapTag<T> d;
  std::uint32_t bits = 0;
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d))
    bits |= mask_bits(d, hn::Or(hn::Load(d, gaps.gap + lane) < hn::Set(d, gap_limit),
                                hn::Load(d, gaps.cover + lane) < hn::Set(d, cover_limit)))
            << lane;
  return bits;
}

template <class T>
HWY_INLINE LeafGap leaf_gap_as(const GapSide& side, std::uint32_t block_x, std::uint32_t block_y,
                               double gap_limit, double cover_limit) {
  const GapTag<T> d;
  using V = hn::Vec<decltype(d)>;
  // Spheres of x whose gaps to y's leaf ball are below a limit.
  Gaps<T> reach;
  child_gaps_as<T>(side, {0, block_x}, {0, block_y}, reach);
  const std::uint32_t tasks = nearer(reach, static_cast<T>(gap_limit), static_cast<T>(cover_limit));
  LeafGap result{static_cast<double>(hwy::HighestValue<T>()),
                 static_cast<double>(hwy::HighestValue<T>()), 0, 0};
  if (tasks == 0) return result;

  const BallBlock& bx = side.x->level[0].blocks[block_x];
  const BallBlock& by = side.y->level[0].blocks[block_y];
  const Origin& origin_x = side.x->level[0].origins[block_x];
  const Origin& origin_y = side.y->level[0].origins[block_y];
  const float* covers_x = side.x->sphere_cover + std::size_t{kWidth} * block_x;
  const float* covers_y = side.y->sphere_cover + std::size_t{kWidth} * block_y;
  const Similarity& map = *side.x_from_y;
  double offset[3];
  map.apply({origin_y.x, origin_y.y, origin_y.z}, offset);
  const V ox = hn::Set(d, static_cast<T>(offset[0] - origin_x.x));
  const V oy = hn::Set(d, static_cast<T>(offset[1] - origin_x.y));
  const V oz = hn::Set(d, static_cast<T>(offset[2] - origin_x.z));
  const V scale = hn::Set(d, static_cast<T>(map.scale));
  V m[9];
  for (int i = 0; i < 9; ++i) {
    if constexpr (sizeof(T) == sizeof(float)) {
      m[i] = hn::Set(d, side.float32[i]);
    } else {
      m[i] = hn::Set(d, map.m[i]);
    }
  }

  // Each lane keeps its own least gap, so that ties do not depend on the vector width.
  alignas(64) T least[kWidth], least_cover[kWidth], task_of[kWidth];
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const V x = load_as<T>(d, by.x + lane);
    const V y = load_as<T>(d, by.y + lane);
    const V z = load_as<T>(d, by.z + lane);
    const V xj = ((m[0] * x + m[1] * y) + m[2] * z) + ox;
    const V yj = ((m[3] * x + m[4] * y) + m[5] * z) + oy;
    const V zj = ((m[6] * x + m[7] * y) + m[8] * z) + oz;
    const V rj = load_as<T>(d, by.r + lane) * scale;
    const V cj = load_as<T>(d, covers_y + lane) * scale;
    V gap = hn::Set(d, hwy::HighestValue<T>());
    V cover = gap;
    V task = hn::Zero(d);
    for (const std::uint32_t i : set_bits(tasks)) {
      const V dx = xj - hn::Set(d, static_cast<T>(bx.x[i]));
      const V dy = yj - hn::Set(d, static_cast<T>(bx.y[i]));
      const V dz = zj - hn::Set(d, static_cast<T>(bx.z[i]));
      const V distance = hn::Sqrt((dx * dx + dy * dy) + dz * dz);
      const V here = (distance - hn::Set(d, static_cast<T>(bx.r[i]))) - rj;
      task = hn::IfThenElse(here < gap, hn::Set(d, static_cast<T>(i)), task);
      gap = hn::Min(gap, here);
      cover = hn::Min(cover, (distance - hn::Set(d, static_cast<T>(covers_x[i]))) - cj);
    }
    hn::Store(gap, d, least + lane);
    hn::Store(cover, d, least_cover + lane);
    hn::Store(task, d, task_of + lane);
  }
  for (std::uint32_t lane = 0; lane < kWidth; ++lane) {
    if (static_cast<double>(least[lane]) < result.gap)
      result = {static_cast<double>(least[lane]), result.cover,
                static_cast<std::uint32_t>(task_of[lane]), lane};
    result.cover = std::min(result.cover, static_cast<double>(least_cover[lane]));
  }
  return result;
}

/// A limit in T that is not less than this one.
template <class T>
T rounded_up(double limit) {
  constexpr double kMost = sizeof(T) == sizeof(float) ? 1e38 : 1e300;
  const double finite = std::clamp(limit, -kMost, kMost);
  return static_cast<T>(finite + 1e-6 * std::abs(finite));
}

template <class T>
HWY_INLINE void child_gaps_to(const GapSide& side, TreeNode x, TreeNode y, double gap_limit,
                              double cover_limit, ChildGaps& out) {
  Gaps<T> gaps;
  child_gaps_as<T>(side, x, y, gaps);
  out.near = nearer(gaps, rounded_up<T>(gap_limit), rounded_up<T>(cover_limit));
  for (const std::uint32_t lane : set_bits(out.near)) {
    out.gap[lane] = static_cast<double>(gaps.gap[lane]);
    out.cover[lane] = static_cast<double>(gaps.cover[lane]);
  }
}

void child(const GapSide& side, TreeNode x, TreeNode y, double gap_limit, double cover_limit,
           ChildGaps& out) {
  side.precision == Precision::float32
      ? child_gaps_to<float>(side, x, y, gap_limit, cover_limit, out)
      : child_gaps_to<double>(side, x, y, gap_limit, cover_limit, out);
}

std::uint32_t around(const BallBlock& balls, const float (&point)[3], float (&depth)[kWidth]) {
  const LaneTag<float> d;
  std::uint32_t bits = 0;
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const auto dx = hn::Set(d, point[0]) - hn::Load(d, balls.x + lane),
               dy = hn::Set(d, point[1]) - hn::Load(d, balls.y + lane),
               dz = hn::Set(d, point[2]) - hn::Load(d, balls.z + lane),
               r = hn::Max(hn::Load(d, balls.r + lane), hn::Zero(d)),
               in = r * r - ((dx * dx + dy * dy) + dz * dz);
    hn::StoreU(in, d, depth + lane);
    bits |= mask_bits(d, in > hn::Zero(d)) << lane;
  }
  return bits;
}

LeafGap leaf(const GapSide& side, std::uint32_t block_x, std::uint32_t block_y, double gap_limit,
             double cover_limit) {
  return side.precision == Precision::float32
             ? leaf_gap_as<float>(side, block_x, block_y, gap_limit, cover_limit)
             : leaf_gap_as<double>(side, block_x, block_y, gap_limit, cover_limit);
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(child);
HWY_EXPORT(leaf);
HWY_EXPORT(around);

std::uint32_t balls_around(const BallBlock& balls, const float (&point)[3],
                           float (&depth)[kWidth]) noexcept {
  return HWY_DYNAMIC_DISPATCH(around)(balls, point, depth);
}

void child_gaps(const GapSide& side, TreeNode x, TreeNode y, double gap_limit, double cover_limit,
                ChildGaps& out) noexcept {
  HWY_DYNAMIC_DISPATCH(child)(side, x, y, gap_limit, cover_limit, out);
}

LeafGap leaf_gap(const GapSide& side, std::uint32_t block_x, std::uint32_t block_y,
                 double gap_limit, double cover_limit) noexcept {
  return HWY_DYNAMIC_DISPATCH(leaf)(side, block_x, block_y, gap_limit, cover_limit);
}

}  // namespace ist
#endif
