#include "query/leaf_kernel.h"

#include <cmath>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/leaf_kernel.cpp"
#include <hwy/foreach_target.h>

#include "query/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// Sixteen spheres in the frame of A's block.
template <class T>
struct alignas(64) Spheres {
  T x[kWidth], y[kWidth], z[kWidth], r[kWidth];
};

/// Sums of one pair of blocks, a lane a sphere of the side that lies in lanes.
template <class T>
struct alignas(64) PairSums {
  T caps[kWidth];
  T force[3][kWidth], torque[3][kWidth], moment[3][kWidth];
  T error[kWidth];
};

/// Which spheres of a block the other block's ball leaves in play.
struct Reach {
  std::uint32_t touching = 0;  ///< spheres that come within reach of the ball
  std::uint32_t holding = 0;   ///< of these, spheres that hold the whole ball
};

template <class T>
HWY_INLINE Reach reach_of(const Spheres<T>& s, const double (&q)[3], double radius, double error) {
  const LaneTag<T> d;
  const auto qx = hn::Set(d, static_cast<T>(q[0]));
  const auto qy = hn::Set(d, static_cast<T>(q[1]));
  const auto qz = hn::Set(d, static_cast<T>(q[2]));
  const auto reach = hn::Set(d, static_cast<T>(radius + error));
  Reach result;
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const auto dx = hn::Load(d, s.x + lane) - qx;
    const auto dy = hn::Load(d, s.y + lane) - qy;
    const auto dz = hn::Load(d, s.z + lane) - qz;
    const auto d2 = (dx * dx + dy * dy) + dz * dz;
    const auto r = hn::Load(d, s.r + lane);
    const auto sum = hn::Max(r + reach, hn::Zero(d));
    const auto difference = hn::Max(r - reach, hn::Zero(d));
    result.touching |= mask_bits(d, d2 < sum * sum) << lane;
    result.holding |= mask_bits(d, d2 < difference * difference) << lane;
  }
  return result;
}

/// Spheres of `one`, of those in `tasks`, that come near any of the lanes: a cheap look that spares
/// most tasks the roots and divisions.
template <class T>
HWY_INLINE std::uint32_t near_tasks(const Spheres<T>& one, std::uint32_t tasks,
                                    const Spheres<T>& many, std::size_t lane, double error) {
  const LaneTag<T> d;
  const auto xj = hn::Load(d, many.x + lane);
  const auto yj = hn::Load(d, many.y + lane);
  const auto zj = hn::Load(d, many.z + lane);
  const auto reach = hn::Load(d, many.r + lane) + hn::Set(d, static_cast<T>(2 * error));
  std::uint32_t near = 0;
  for (std::uint32_t left = tasks; left != 0; left &= left - 1) {
    const std::size_t i = hwy::Num0BitsBelowLS1Bit_Nonzero32(left);
    const auto dx = xj - hn::Set(d, one.x[i]);
    const auto dy = yj - hn::Set(d, one.y[i]);
    const auto dz = zj - hn::Set(d, one.z[i]);
    const auto sum = hn::Max(reach + hn::Set(d, one.r[i]), hn::Zero(d));
    const bool none = hn::AllFalse(d, ((dx * dx + dy * dy) + dz * dz) < sum * sum);
    near |= static_cast<std::uint32_t>(!none) << i;
  }
  return near;
}

/// Which spheres meet which, and how: what sum_lenses is to add.
struct LensTasks {
  std::uint32_t tasks;    ///< spheres of `one` that go one by one
  std::uint32_t holding;  ///< spheres of `one` that swallow all of `many`
  std::uint32_t lanes;    ///< spheres of `many` in play
  double sign;            ///< 1 if `many` are B's
  double error;           ///< bound on the rounding of a distance
};

/// Lenses of spheres of `one` with all of `many`: lens() of lens.h, sixteen at a time and without
/// branches. Returns how many are not empty. `any` is left false if `out` is all zero.
template <class T>
HWY_INLINE std::uint32_t sum_lenses(const Spheres<T>& one, const Spheres<T>& many,
                                    const LensTasks& what, const double (&lever)[3],
                                    PairSums<T>& out, bool& any) {
  const LaneTag<T> d;
  const std::size_t width = hn::Lanes(d);
  using V = hn::Vec<decltype(d)>;
  const V zero = hn::Zero(d);
  const V two = hn::Set(d, T(2));
  const V three = hn::Set(d, T(3));
  const V half = hn::Set(d, T(0.5));
  const V tiny = hn::Set(d, std::numeric_limits<T>::min());
  const V delta = hn::Set(d, static_cast<T>(what.error));
  const std::size_t holding = hwy::PopCount(what.holding);
  const V held = hn::Set(d, static_cast<T>(4 * holding));
  const V flip = hn::Set(d, static_cast<T>(what.sign));
  const std::uint32_t width_mask = (1u << width) - 1;
  std::uint32_t lenses = 0;
  for (std::size_t lane = 0; lane < kWidth; lane += width) {
    V caps = zero, fx = zero, fy = zero, fz = zero, mx = zero, my = zero, mz = zero, err = zero;
    V lx = zero, ly = zero, lz = zero;
    const std::uint32_t tasks = ((what.lanes >> lane) & width_mask) != 0
                                    ? near_tasks<T>(one, what.tasks, many, lane, what.error)
                                    : 0;
    if (tasks != 0 || holding != 0) {
      any = true;
      const V xj = hn::Load(d, many.x + lane);
      const V yj = hn::Load(d, many.y + lane);
      const V zj = hn::Load(d, many.z + lane);
      const V rj = hn::Max(hn::Load(d, many.r + lane), zero);
      caps = held * (rj * (rj * rj));
      lenses += static_cast<std::uint32_t>(holding * hn::CountTrue(d, rj > zero));
      for (std::uint32_t left = tasks; left != 0; left &= left - 1) {
        const std::size_t i = hwy::Num0BitsBelowLS1Bit_Nonzero32(left);
        const V ri = hn::Set(d, one.r[i]);
        const V dx = xj - hn::Set(d, one.x[i]);
        const V dy = yj - hn::Set(d, one.y[i]);
        const V dz = zj - hn::Set(d, one.z[i]);
        const V distance = hn::Sqrt((dx * dx + dy * dy) + dz * dz);
        const V a = hn::Max(ri, rj);
        const V b = hn::Min(ri, rj);
        const V g = (a - distance) + b;
        const V step = a - b;
        const V f = hn::IfThenElse(step <= b, distance - step, (distance - a) + b);
        const V e = step + distance;
        const V g0 = hn::Max(g, zero);
        const auto holds = hn::Or(f <= zero, distance < tiny);
        const V inverse = half / hn::Max(distance, tiny);
        const V ha = hn::IfThenZeroElse(holds, (f * inverse) * g0);
        const V diameter = two * b;
        const V hb = hn::IfThenElse(holds, diameter, hn::Min((e * inverse) * g0, diameter));
        const V large = (ha * ha) * (three * a - ha);
        const V small = (hb * hb) * (three * b - hb);
        const V circle = ha * (two * a - ha);
        const V volume = large + small;
        const V cap_i = hn::IfThenElse(ri > rj, large, small);
        const V pull = circle * inverse;
        caps = caps + volume;
        fx = fx + pull * dx;
        fy = fy + pull * dy;
        fz = fz + pull * dz;
        mx = mx + cap_i * dx;
        my = my + cap_i * dy;
        mz = mz + cap_i * dz;
        // Within rounding of tangency the circle says nothing; b² holds it at any distance. Else it
        // is concave between the tangencies, so within ± delta it is at most doubled.
        const V near = hn::Abs(hn::Min(g, f));
        err = err + hn::IfThenElse(near < delta, b * b, circle);
        lenses += static_cast<std::uint32_t>(hn::CountTrue(d, volume > zero));
      }
      lx = xj + hn::Set(d, static_cast<T>(lever[0]));
      ly = yj + hn::Set(d, static_cast<T>(lever[1]));
      lz = zj + hn::Set(d, static_cast<T>(lever[2]));
      fx = fx * flip;
      fy = fy * flip;
      fz = fz * flip;
    }
    hn::Store(caps, d, out.caps + lane);
    hn::Store(err * delta, d, out.error + lane);
    hn::Store(fx, d, out.force[0] + lane);
    hn::Store(fy, d, out.force[1] + lane);
    hn::Store(fz, d, out.force[2] + lane);
    hn::Store(ly * fz - lz * fy, d, out.torque[0] + lane);
    hn::Store(lz * fx - lx * fz, d, out.torque[1] + lane);
    hn::Store(lx * fy - ly * fx, d, out.torque[2] + lane);
    hn::Store(caps * lx - mx, d, out.moment[0] + lane);
    hn::Store(caps * ly - my, d, out.moment[1] + lane);
    hn::Store(caps * lz - mz, d, out.moment[2] + lane);
  }
  return lenses;
}

/// total[l] += from[l] + from[l + 8], the last additions in double.
template <class T>
HWY_INLINE void fold(const T* from, double* total) {
  const hn::CappedTag<double, kSumLanes> d;
  for (std::size_t lane = 0; lane < kSumLanes; lane += hn::Lanes(d)) {
    hn::Vec<decltype(d)> sum;
    if constexpr (sizeof(T) == sizeof(float)) {
      const hn::Rebind<float, decltype(d)> df;
      sum = hn::PromoteTo(d, hn::Load(df, from + lane) + hn::Load(df, from + lane + kSumLanes));
    } else {
      sum = hn::Load(d, from + lane) + hn::Load(d, from + lane + kSumLanes);
    }
    hn::Store(hn::Load(d, total + lane) + sum, d, total + lane);
  }
}

template <class T>
HWY_INLINE void add_pair(const PairSums<T>& pair, LeafSums& sums) {
  fold(pair.caps, sums.caps);
  fold(pair.error, sums.error);
  for (int k = 0; k < 3; ++k) {
    fold(pair.force[k], sums.force[k]);
    fold(pair.torque[k], sums.torque[k]);
    fold(pair.moment[k], sums.moment[k]);
  }
}

/// A leaf block of B turned and scaled into A's axes, not yet shifted: runs of pairs share it.
template <class T>
struct TurnedBlock {
  Spheres<T> spheres;
  double origin[3] = {};  ///< A's unit frame
  double centre[3] = {};  ///< of the leaf ball, A's unit frame
  double radius = 0;
  double own_size = 0;  ///< bound on |origin − any centre| of the block
};

template <class T>
HWY_INLINE void turn_block(const SphereTree& tree, std::uint32_t block, const Similarity& map,
                           TurnedBlock<T>& out) {
  const LaneTag<T> d;
  hn::Vec<decltype(d)> m[9];
  for (int i = 0; i < 9; ++i) m[i] = hn::Set(d, static_cast<T>(map.m[i]));
  const auto scale = hn::Set(d, static_cast<T>(map.scale));
  const BallBlock& balls = tree.level[0].blocks[block];
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const auto x = load_as<T>(d, balls.x + lane);
    const auto y = load_as<T>(d, balls.y + lane);
    const auto z = load_as<T>(d, balls.z + lane);
    hn::Store((m[0] * x + m[1] * y) + m[2] * z, d, out.spheres.x + lane);
    hn::Store((m[3] * x + m[4] * y) + m[5] * z, d, out.spheres.y + lane);
    hn::Store((m[6] * x + m[7] * y) + m[8] * z, d, out.spheres.z + lane);
    hn::Store(load_as<T>(d, balls.r + lane) * scale, d, out.spheres.r + lane);
  }
  const Origin& origin = tree.level[0].origins[block];
  const NodeBall ball = tree.ball(0, block);
  map.apply({origin.x, origin.y, origin.z}, out.origin);
  map.apply(ball.centre, out.centre);
  out.radius = ball.r * map.scale;
  out.own_size = out.radius;
  for (int k = 0; k < 3; ++k) out.own_size += std::abs(out.centre[k] - out.origin[k]);
}

template <class T>
HWY_INLINE void shift(const Spheres<T>& from, const double (&offset)[3], Spheres<T>& to) {
  const LaneTag<T> d;
  const auto ox = hn::Set(d, static_cast<T>(offset[0]));
  const auto oy = hn::Set(d, static_cast<T>(offset[1]));
  const auto oz = hn::Set(d, static_cast<T>(offset[2]));
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    hn::Store(hn::Load(d, from.x + lane) + ox, d, to.x + lane);
    hn::Store(hn::Load(d, from.y + lane) + oy, d, to.y + lane);
    hn::Store(hn::Load(d, from.z + lane) + oz, d, to.z + lane);
    hn::Store(hn::Load(d, from.r + lane), d, to.r + lane);
  }
}

template <class T>
HWY_INLINE void load_block(const BallBlock& block, Spheres<T>& to) {
  const LaneTag<T> d;
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    hn::Store(load_as<T>(d, block.x + lane), d, to.x + lane);
    hn::Store(load_as<T>(d, block.y + lane), d, to.y + lane);
    hn::Store(load_as<T>(d, block.z + lane), d, to.z + lane);
    hn::Store(load_as<T>(d, block.r + lane), d, to.r + lane);
  }
}

template <class T>
void add_as(const LeafStage& stage, const std::uint32_t* a, const std::uint32_t* b, std::size_t n,
            LeafSums& sums) {
  const Similarity& map = *stage.a_from_b;
  Spheres<T> sa, sb;
  TurnedBlock<T> turned;
  PairSums<T> pair;
  std::uint32_t last_b = ~0u;
  for (std::size_t i = 0; i < n; ++i) {
    if (b[i] != last_b) {
      last_b = b[i];
      turn_block<T>(*stage.b, last_b, map, turned);
    }
    // All that follows is relative to the origin of A's block: differences taken in double.
    const Origin& o = stage.a->level[0].origins[a[i]];
    const NodeBall ball_a = stage.a->ball(0, a[i]);
    const double origin[3] = {o.x, o.y, o.z};
    double offset[3], p[3], q[3], lever[3];
    double magnitude = ball_a.r + turned.own_size;
    for (int k = 0; k < 3; ++k) {
      offset[k] = turned.origin[k] - origin[k];
      q[k] = turned.centre[k] - origin[k];
      p[k] = ball_a.centre[k] - origin[k];
      lever[k] = origin[k] - map.t[k];
      magnitude += std::abs(offset[k]) + std::abs(p[k]);
    }
    LensTasks what;
    what.error = distance_error<T>(magnitude);
    load_block<T>(stage.a->level[0].blocks[a[i]], sa);
    const Reach ra = reach_of<T>(sa, q, turned.radius, what.error);
    if (ra.touching == 0) continue;
    shift<T>(turned.spheres, offset, sb);
    const Reach rb = reach_of<T>(sb, p, ball_a.r, what.error);
    if (rb.touching == 0) continue;

    // The side with fewer spheres in play goes one by one; the other lies in lanes.
    const std::uint32_t tasks_a = ra.touching & ~ra.holding;
    const std::uint32_t tasks_b = rb.touching & ~rb.holding;
    const bool lanes_b = hwy::PopCount(tasks_a) <= hwy::PopCount(tasks_b);
    what.tasks = lanes_b ? tasks_a : tasks_b;
    what.holding = lanes_b ? ra.holding : rb.holding;
    what.lanes = lanes_b ? rb.touching : ra.touching;
    what.sign = lanes_b ? 1 : -1;
    bool any = false;
    sums.lenses += sum_lenses<T>(lanes_b ? sa : sb, lanes_b ? sb : sa, what, lever, pair, any);
    if (!any) continue;
    add_pair(pair, sums);
    if (stage.bins.sums != nullptr)
      add_pair(pair, stage.bins.sums[stage.bins.node[i] >> stage.bins.shift]);
  }
}

void add_single(const LeafStage& stage, const std::uint32_t* a, const std::uint32_t* b,
                std::size_t n, LeafSums& sums) {
  add_as<float>(stage, a, b, n, sums);
}

void add_twice(const LeafStage& stage, const std::uint32_t* a, const std::uint32_t* b,
               std::size_t n, LeafSums& sums) {
  add_as<double>(stage, a, b, n, sums);
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(add_single);
HWY_EXPORT(add_twice);

void add_leaf_pairs(const LeafStage& stage, const std::uint32_t* a, const std::uint32_t* b,
                    std::size_t n, LeafSums& sums) noexcept {
  if (stage.precision == Precision::single) {
    HWY_DYNAMIC_DISPATCH(add_single)(stage, a, b, n, sums);
  } else {
    HWY_DYNAMIC_DISPATCH(add_twice)(stage, a, b, n, sums);
  }
}

}  // namespace ist
#endif
