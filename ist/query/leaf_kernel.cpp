#include "query/leaf_kernel.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/leaf_kernel.cpp"
#include <hwy/foreach_target.h>

#include "query/lanes-inl.h"
#include "query/lens_list-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// Pairs that go through the stages together: little enough to stay in the nearest cache.
inline constexpr std::size_t kPairsAtOnce = 64;

/// Sixteen spheres in A's axes, relative to an origin of their own.
template <class T>
struct alignas(64) Spheres {
  T x[kWidth], y[kWidth], z[kWidth], r[kWidth];
};

/// One side of a pair of leaf blocks, in A's unit frame. Four numbers, since vectors hold so many.
template <class T>
struct alignas(32) Side {
  double origin[4];        ///< of the spheres' coordinates
  double centre[4];        ///< of the leaf ball
  alignas(32) T lever[4];  ///< from B's origin to this one
  double radius;           ///< of the leaf ball
  double size;             ///< bound on the way from the origin to the end of any sphere
  const Spheres<T>* spheres;
};

/// Blocks that were met lately: neighbours in a list of pairs share the blocks below one node.
template <class T>
class BlockCache {
 public:
  struct Entry {
    std::uint32_t block = ~0u;
    std::uint32_t round = 0;  ///< that last used it
    Side<T> side;
    Spheres<T> room;
  };

  /// The entry of a block, which `fill` makes if it is not there; null if this round uses its place
  /// for another one.
  template <class Fill>
  HWY_INLINE const Side<T>* find(std::uint32_t block, std::uint32_t round, Fill fill) {
    Entry& entry = entries_[block % kEntries];
    if (entry.block != block) {
      if (entry.round == round) return nullptr;
      entry.block = block;
      fill(entry);
    }
    entry.round = round;
    return &entry.side;
  }

 private:
  static constexpr std::size_t kEntries = 32;
  Entry entries_[kEntries];
};

/// What the tasks of one pair of leaf blocks share.
template <class T>
struct alignas(32) PairOfBlocks {
  const Side<T>* many;  ///< the side whose sixteen spheres lie in lanes
  T error;              ///< bound on the rounding of a distance; negative if the tasks are B's
  std::uint32_t bin;
};

/// Single spheres, each to meet sixteen: centres relative to the sixteen's origin.
template <class T>
struct alignas(64) Tasks {
  static constexpr std::size_t kRoom = (kPairsAtOnce + 1) * kWidth;
  T x[kRoom], y[kRoom], z[kRoom], r[kRoom];
  std::uint32_t pair[kRoom];
  std::size_t size = 0;
};

inline constexpr double kSign[2] = {1, -1};

/// The map from B's unit frame to A's in the forms the stages load: T row by row, and columns.
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

/// Where a leaf block of A and its ball are.
template <class T>
HWY_INLINE void place(const SphereTree& tree, std::uint32_t block, Side<T>& side) {
  const Origin& o = tree.level[0].origins[block];
  const NodeBall ball = tree.ball(0, block);
  const double origin[3] = {o.x, o.y, o.z};
  side.size = side.radius = ball.r;
  for (int k = 0; k < 3; ++k) {
    side.origin[k] = origin[k];
    side.centre[k] = ball.centre[k];
    side.size += std::abs(ball.centre[k] - origin[k]);
  }
  side.origin[3] = side.centre[3] = 0;  // converted to float with the others
}

/// Likewise of B.
template <class T>
HWY_INLINE void place(const SphereTree& tree, std::uint32_t block, const TurnedAxes<T>& axes,
                      Side<T>& side) {
  const FourDoubles d;
  const Origin& o = tree.level[0].origins[block];
  const NodeBall ball = tree.ball(0, block);
  alignas(32) double way[4];
  side.radius = ball.r * axes.scale;
  for (std::size_t k = 0; k < 4; k += hn::Lanes(d)) {
    const auto x = hn::Load(d, axes.column[0] + k);
    const auto y = hn::Load(d, axes.column[1] + k);
    const auto z = hn::Load(d, axes.column[2] + k);
    const auto t = hn::Load(d, axes.column[3] + k);
    const auto origin = ((x * hn::Set(d, o.x) + y * hn::Set(d, o.y)) + z * hn::Set(d, o.z)) + t;
    const auto centre = ((x * hn::Set(d, ball.centre[0]) + y * hn::Set(d, ball.centre[1])) +
                         z * hn::Set(d, ball.centre[2])) +
                        t;
    hn::Store(origin, d, side.origin + k);
    hn::Store(centre, d, side.centre + k);
    hn::Store(hn::Abs(centre - origin), d, way + k);
  }
  side.size = side.radius + ((way[0] + way[1]) + way[2]);
}

/// Differences are taken in double (DESIGN 3.4).
template <class T>
HWY_INLINE void subtract(const double (&x)[4], const double (&y)[4], T (&difference)[4]) {
  const hn::CappedTag<double, 4> d;
  for (std::size_t k = 0; k < 4; k += hn::Lanes(d)) {
    const auto exact = hn::Load(d, x + k) - hn::Load(d, y + k);
    if constexpr (sizeof(T) == sizeof(float)) {
      const hn::Rebind<float, decltype(d)> df;
      hn::Store(hn::DemoteTo(df, exact), df, difference + k);
    } else {
      hn::Store(exact, d, difference + k);
    }
  }
}

/// A leaf block of A; floats lie in the asset as they are needed.
template <class T>
HWY_INLINE void take_block(const SphereTree& tree, std::uint32_t block, Spheres<T>& room,
                           Side<T>& side) {
  const BallBlock& balls = tree.level[0].blocks[block];
  if constexpr (sizeof(T) == sizeof(float)) {
    static_assert(sizeof(Spheres<float>) == sizeof(BallBlock));
    side.spheres = reinterpret_cast<const Spheres<float>*>(&balls);
  } else {
    const LaneTag<T> d;
    for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
      hn::Store(load_as<T>(d, balls.x + lane), d, room.x + lane);
      hn::Store(load_as<T>(d, balls.y + lane), d, room.y + lane);
      hn::Store(load_as<T>(d, balls.z + lane), d, room.z + lane);
      hn::Store(load_as<T>(d, balls.r + lane), d, room.r + lane);
    }
    side.spheres = &room;
  }
  place(tree, block, side);
}

/// A leaf block of B, turned and scaled into A's axes.
template <class T>
HWY_INLINE void turn_block(const SphereTree& tree, std::uint32_t block, const TurnedAxes<T>& axes,
                           Spheres<T>& room, Side<T>& side) {
  const LaneTag<T> d;
  hn::Vec<decltype(d)> m[9];
  for (int i = 0; i < 9; ++i) m[i] = hn::Set(d, axes.m[i]);
  const auto scale = hn::Set(d, static_cast<T>(axes.scale));
  const BallBlock& balls = tree.level[0].blocks[block];
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const auto x = load_as<T>(d, balls.x + lane);
    const auto y = load_as<T>(d, balls.y + lane);
    const auto z = load_as<T>(d, balls.z + lane);
    hn::Store((m[0] * x + m[1] * y) + m[2] * z, d, room.x + lane);
    hn::Store((m[3] * x + m[4] * y) + m[5] * z, d, room.y + lane);
    hn::Store((m[6] * x + m[7] * y) + m[8] * z, d, room.z + lane);
    hn::Store(load_as<T>(d, balls.r + lane) * scale, d, room.r + lane);
  }
  side.spheres = &room;
  place(tree, block, axes, side);
}

/// Appends the spheres of `one` that come within reach of the ball of `many`, or only the sphere
/// `single` if that is not negative.
template <class T>
HWY_INLINE void add_tasks(const Side<T>& one, const Side<T>& many, int single, double error,
                          std::uint32_t pair, Tasks<T>& tasks) {
  const LaneTag<T> d;
  const hn::Repartition<std::uint32_t, hn::CappedTag<float, kWidth>> du;
  alignas(32) T q[4], offset[4];
  subtract(many.centre, one.origin, q);
  subtract(one.origin, many.origin, offset);
  const auto reach = hn::Set(d, static_cast<T>(many.radius + error));
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const auto x = hn::Load(d, one.spheres->x + lane);
    const auto y = hn::Load(d, one.spheres->y + lane);
    const auto z = hn::Load(d, one.spheres->z + lane);
    const auto r = hn::Load(d, one.spheres->r + lane);
    const auto dx = x - hn::Set(d, q[0]);
    const auto dy = y - hn::Set(d, q[1]);
    const auto dz = z - hn::Set(d, q[2]);
    // Negative for an unused lane, whose square must not count.
    const auto sum = hn::Max(r + reach, hn::Zero(d));
    auto near = ((dx * dx + dy * dy) + dz * dz) < sum * sum;
    if (single >= 0)
      near = hn::And(near, hn::Iota(d, static_cast<T>(lane)) == hn::Set(d, static_cast<T>(single)));
    const Compressor compress(d, near);
    const std::size_t at = tasks.size;
    hn::StoreU(compress(x + hn::Set(d, offset[0])), d, tasks.x + at);
    hn::StoreU(compress(y + hn::Set(d, offset[1])), d, tasks.y + at);
    hn::StoreU(compress(z + hn::Set(d, offset[2])), d, tasks.z + at);
    hn::StoreU(compress(r), d, tasks.r + at);
    for (std::size_t i = 0; i < hn::Lanes(d); i += hn::Lanes(du))
      hn::StoreU(hn::Set(du, pair), du, tasks.pair + at + i);
    tasks.size += compress.count();
  }
}

/// Appends what task `k` meets, or all but meets: its rounding counts too.
template <class T>
HWY_INLINE void add_lenses(const Tasks<T>& tasks, std::size_t k, const PairOfBlocks<T>& pair,
                           bool binned, LensList<T>& list) {
  const LaneTag<T> d;
  const auto xi = hn::Set(d, tasks.x[k]);
  const auto yi = hn::Set(d, tasks.y[k]);
  const auto zi = hn::Set(d, tasks.z[k]);
  const auto ri = hn::Set(d, tasks.r[k]);
  const auto lx = xi + hn::Set(d, pair.many->lever[0]);
  const auto ly = yi + hn::Set(d, pair.many->lever[1]);
  const auto lz = zi + hn::Set(d, pair.many->lever[2]);
  const auto error = hn::Set(d, pair.error);
  const auto reach = ri + (hn::Abs(error) + hn::Abs(error));
  const std::size_t before = list.size;
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const auto rj = hn::Load(d, pair.many->spheres->r + lane);
    const auto dx = hn::Load(d, pair.many->spheres->x + lane) - xi;
    const auto dy = hn::Load(d, pair.many->spheres->y + lane) - yi;
    const auto dz = hn::Load(d, pair.many->spheres->z + lane) - zi;
    const auto sum = hn::Max(rj + reach, hn::Zero(d));
    const auto near = ((dx * dx + dy * dy) + dz * dz) < sum * sum;
    const Compressor compress(d, near);
    const std::size_t at = list.size;
    hn::StoreU(compress(dx), d, list.dx + at);
    hn::StoreU(compress(dy), d, list.dy + at);
    hn::StoreU(compress(dz), d, list.dz + at);
    hn::StoreU(compress(rj), d, list.rj + at);
    hn::StoreU(ri, d, list.ri + at);
    hn::StoreU(lx, d, list.lx + at);
    hn::StoreU(ly, d, list.ly + at);
    hn::StoreU(lz, d, list.lz + at);
    hn::StoreU(error, d, list.error + at);
    list.size += compress.count();
  }
  if (binned) std::fill(list.bin + before, list.bin + list.size, pair.bin);
}

template <class T>
std::size_t add_as(const LeafStage& stage, const std::uint32_t* a, const std::uint32_t* b,
                   std::size_t n, LeafSums& sums) {
  const Similarity& map = *stage.a_from_b;
  LeafSums* const bins = stage.bins.sums;
  const bool single_a = stage.level_a == kSphereLevel;
  const bool single_b = stage.level_b == kSphereLevel;
  const std::uint32_t either = !single_a && !single_b ? 1 : 0;
  const std::uint32_t only_b = single_b ? 1 : 0;
  alignas(32) const double origin_b[4] = {map.t[0], map.t[1], map.t[2], 0};
  const TurnedAxes<T> axes(map);
  BlockCache<T> blocks_a, blocks_b;
  PairOfBlocks<T> pairs[kPairsAtOnce];
  Tasks<T> tasks;
  LensList<T> list;
  std::uint32_t round = 0;
  std::size_t done = 0;
  while (done < n && !(done > 0 && stage.budget != nullptr && stage.budget->visits_end())) {
    const std::size_t most = std::min(kPairsAtOnce, n - done);
    ++round;
    tasks.size = 0;
    std::size_t i = 0;
    for (; i < most; ++i) {
      const std::uint32_t block_a = single_a ? a[done + i] / kWidth : a[done + i];
      const std::uint32_t block_b = single_b ? b[done + i] / kWidth : b[done + i];
      const Side<T>* const sides[2] = {
          blocks_a.find(block_a, round,
                        [&](auto& to) {
                          take_block<T>(*stage.a, block_a, to.room, to.side);
                          subtract(to.side.origin, origin_b, to.side.lever);
                        }),
          blocks_b.find(block_b, round, [&](auto& to) {
            turn_block<T>(*stage.b, block_b, axes, to.room, to.side);
            subtract(to.side.origin, origin_b, to.side.lever);
          })};
      if (sides[0] == nullptr || sides[1] == nullptr) break;
      // The side of the larger spread goes one by one: fewer of its spheres come near the other.
      const std::uint32_t task_side =
          (static_cast<std::uint32_t>(sides[0]->radius <= sides[1]->radius) & either) | only_b;
      const Side<T>& one = *sides[task_side];
      const Side<T>& many = *sides[1 - task_side];
      // The two touch: their origins are no further apart than both sizes.
      const double error = distance_error<T>(2.8 * (one.size + many.size));
      PairOfBlocks<T>& pair = pairs[i];
      pair.many = &many;
      pair.error = static_cast<T>(error * kSign[task_side]);
      pair.bin = bins != nullptr ? stage.bins.node[done + i] >> stage.bins.shift : 0;
      const int single = single_a   ? static_cast<int>(a[done + i] % kWidth)
                         : single_b ? static_cast<int>(b[done + i] % kWidth)
                                    : -1;
      add_tasks<T>(one, many, single, error, static_cast<std::uint32_t>(i), tasks);
    }
    done += i;
    for (std::size_t k = 0; k < tasks.size; ++k) {
      add_lenses<T>(tasks, k, pairs[tasks.pair[k]], bins != nullptr, list);
      if (list.size >= kFullList) sum_full_list(list, sums, bins);
    }
  }
  sum_last_lenses(list, sums, bins);
  return done;
}

std::size_t add_single(const LeafStage& stage, const std::uint32_t* a, const std::uint32_t* b,
                       std::size_t n, LeafSums& sums) {
  return add_as<float>(stage, a, b, n, sums);
}

std::size_t add_twice(const LeafStage& stage, const std::uint32_t* a, const std::uint32_t* b,
                      std::size_t n, LeafSums& sums) {
  return add_as<double>(stage, a, b, n, sums);
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(add_single);
HWY_EXPORT(add_twice);

std::size_t add_leaf_pairs(const LeafStage& stage, const std::uint32_t* a, const std::uint32_t* b,
                           std::size_t n, LeafSums& sums) noexcept {
  if (stage.precision == Precision::single) {
    return HWY_DYNAMIC_DISPATCH(add_single)(stage, a, b, n, sums);
  }
  return HWY_DYNAMIC_DISPATCH(add_twice)(stage, a, b, n, sums);
}

}  // namespace ist
#endif
