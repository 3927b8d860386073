// Places leaf blocks. Included once per target.

#if defined(IST_QUERY_PLACED_BLOCKS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_PLACED_BLOCKS_INL_H_
#undef IST_QUERY_PLACED_BLOCKS_INL_H_
#else
#define IST_QUERY_PLACED_BLOCKS_INL_H_
#endif

#include <cmath>

#include "query/kernel/lanes-inl.h"
#include "query/kernel/placed_blocks.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// The map from B's unit frame to A's, as the stages load it: in T by rows, and by columns.
template <class T>
struct alignas(32) TurnedAxes {
  explicit TurnedAxes(const Similarity& map) : scale(map.scale) {
    for (int i = 0; i < 9; ++i) m[i] = static_cast<T>(map.m[i]);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) column[j][i] = map.m[3 * i + j];
      column[3][i] = map.t[i];
    }
  }
  double column[4][4] = {};  ///< the last is the translation
  double scale;
  T m[9];
};

using FourDoubles = hn::CappedTag<double, 4>;

/// Differences are taken in double (docs/design.md 3.4).
template <class T>
HWY_INLINE void subtract(const double (&x)[4], const double (&y)[4], T (&difference)[4]) {
  const FourDoubles d;
  for (std::size_t k = 0; k < 4; k += hn::Lanes(d))
    store_as(hn::Load(d, x + k) - hn::Load(d, y + k), d, difference + k);
}

/// Derives the remaining members. `size`: bound on the spheres' distance from the block's origin.
template <class T>
HWY_INLINE void finish_placing(double size, const TurnedAxes<T>& axes, PlacedBlock<T>& placed) {
  // The origins of two blocks that touch are no further apart than both sizes. The sums with errors
  // are rounded too.
  placed.error = static_cast<T>(distance_error<T>(3 * size));
  subtract(placed.origin, axes.column[3], placed.lever);
}

/// Farther than anything, but with a finite square.
template <class T>
inline constexpr T kFar = sizeof(T) == sizeof(float) ? static_cast<T>(1e18) : static_cast<T>(1e150);

/// Makes the unused lanes of the last block points that are far away.
template <class T>
HWY_INLINE void put_away_unused(const SphereTree& tree, std::uint32_t block, Spheres<T>& spheres) {
  if (block + 1 < tree.level[0].count) return;
  for (std::size_t lane = tree.header->sphere_count - kWidth * block; lane < kWidth; ++lane) {
    spheres.x[lane] = kFar<T>;
    spheres.y[lane] = spheres.z[lane] = spheres.r[lane] = 0;
  }
}

/// Places a leaf block of A. Full blocks of floats are used from the asset directly.
template <class T>
HWY_INLINE void place_block(const SphereTree& tree, std::uint32_t block, const TurnedAxes<T>& axes,
                            PlacedBlock<T>& placed) {
  const BallBlock& balls = tree.level[0].blocks[block];
  if (sizeof(T) == sizeof(float) && block + 1 < tree.level[0].count) {
    static_assert(sizeof(Spheres<float>) == sizeof(BallBlock));
    placed.spheres = reinterpret_cast<const Spheres<T>*>(&balls);
  } else {
    const LaneTag<T> d;
    for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
      hn::Store(load_as<T>(d, balls.x + lane), d, placed.own.x + lane);
      hn::Store(load_as<T>(d, balls.y + lane), d, placed.own.y + lane);
      hn::Store(load_as<T>(d, balls.z + lane), d, placed.own.z + lane);
      hn::Store(load_as<T>(d, balls.r + lane), d, placed.own.r + lane);
    }
    put_away_unused(tree, block, placed.own);
    placed.spheres = &placed.own;
  }
  const Origin& o = tree.level[0].origins[block];
  const NodeBall ball = tree.ball(0, block);
  const double origin[3] = {o.x, o.y, o.z};
  double size = ball.r;
  for (int k = 0; k < 3; ++k) {
    placed.origin[k] = origin[k];
    placed.centre[k] = ball.centre[k];
    size += std::abs(ball.centre[k] - origin[k]);
  }
  placed.origin[3] = placed.centre[3] = 0;  // converted to float with the others
  placed.radius = static_cast<T>(ball.r);
  finish_placing(size, axes, placed);
}

/// Places a leaf block of B, turned and scaled into A's axes.
template <class T>
HWY_INLINE void turn_block(const SphereTree& tree, std::uint32_t block, const TurnedAxes<T>& axes,
                           PlacedBlock<T>& placed) {
  const LaneTag<T> d;
  hn::Vec<decltype(d)> m[9];
  for (int i = 0; i < 9; ++i) m[i] = hn::Set(d, axes.m[i]);
  const auto scale = hn::Set(d, static_cast<T>(axes.scale));
  const BallBlock& balls = tree.level[0].blocks[block];
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const auto x = load_as<T>(d, balls.x + lane);
    const auto y = load_as<T>(d, balls.y + lane);
    const auto z = load_as<T>(d, balls.z + lane);
    hn::Store((m[0] * x + m[1] * y) + m[2] * z, d, placed.own.x + lane);
    hn::Store((m[3] * x + m[4] * y) + m[5] * z, d, placed.own.y + lane);
    hn::Store((m[6] * x + m[7] * y) + m[8] * z, d, placed.own.z + lane);
    hn::Store(load_as<T>(d, balls.r + lane) * scale, d, placed.own.r + lane);
  }
  put_away_unused(tree, block, placed.own);
  placed.spheres = &placed.own;

  const FourDoubles d4;
  const Origin& o = tree.level[0].origins[block];
  const NodeBall ball = tree.ball(0, block);
  alignas(32) double extent[4];
  for (std::size_t k = 0; k < 4; k += hn::Lanes(d4)) {
    const auto x = hn::Load(d4, axes.column[0] + k);
    const auto y = hn::Load(d4, axes.column[1] + k);
    const auto z = hn::Load(d4, axes.column[2] + k);
    const auto t = hn::Load(d4, axes.column[3] + k);
    const auto origin = ((x * hn::Set(d4, o.x) + y * hn::Set(d4, o.y)) + z * hn::Set(d4, o.z)) + t;
    const auto centre = ((x * hn::Set(d4, ball.centre[0]) + y * hn::Set(d4, ball.centre[1])) +
                         z * hn::Set(d4, ball.centre[2])) +
                        t;
    hn::Store(origin, d4, placed.origin + k);
    hn::Store(centre, d4, placed.centre + k);
    hn::Store(hn::Abs(centre - origin), d4, extent + k);
  }
  const double radius = ball.r * axes.scale;
  placed.radius = static_cast<T>(radius);
  finish_placing(radius + ((extent[0] + extent[1]) + extent[2]), axes, placed);
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
