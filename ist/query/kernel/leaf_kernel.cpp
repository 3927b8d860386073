#include "query/kernel/leaf_kernel.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/kernel/leaf_kernel.cpp"
#include <hwy/foreach_target.h>

#include "query/kernel/lanes-inl.h"
#include "query/kernel/lens_list-inl.h"
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

/// Pairs that go through the stages together: few enough for the first-level cache.
inline constexpr std::size_t kPairsAtOnce = 16;
inline constexpr int kWidthBits = 4;
static_assert(1u << kWidthBits == kWidth);
inline constexpr std::size_t kTaskCapacity = kPairsAtOnce * kWidth;

/// Pairs of leaf blocks that go through the stages together. The sixteen spheres of the larger
/// block are sixteen tasks, since fewer of them reach the other's leaf ball: each is tested against
/// the sixteen spheres of the other block. Task 16 i + l is lane l of pair i.
template <class T>
struct alignas(64) PairsOfBlocks {
  T x[kTaskCapacity], y[kTaskCapacity], z[kTaskCapacity];  ///< from the other block's origin
  T reach[kTaskCapacity];                                  ///< radius and rounding
  const PlacedBlock<T>* block[kPairsAtOnce][2];            ///< of A and of B
  const Spheres<T>* one[kPairsAtOnce];                     ///< the tasks
  const Spheres<T>* many[kPairsAtOnce];                    ///< the others
  const T* lever[kPairsAtOnce];                            ///< of the others
  alignas(32) T ball[kPairsAtOnce][4];    ///< the centre of the other's leaf ball from one's origin
  alignas(32) T offset[kPairsAtOnce][4];  ///< one's origin from the other's
  T ball_reach[kPairsAtOnce];             ///< radius of that ball and rounding
  T error[kPairsAtOnce];  ///< bound on the rounding of a distance; negative if the tasks are B's
  std::uint32_t bin[kPairsAtOnce];
  std::uint32_t task[kTaskCapacity + kWidth];  ///< that reach the other's leaf ball
  std::uint32_t hits[kTaskCapacity + 1];       ///< task << 16 | the lanes it overlaps
};

/// The side whose spheres are tasks.
struct Tasks {
  std::size_t of_larger, of_b;  ///< 0 or 1; both 0: A's
};

/// Chooses the block whose spheres are tasks, and places the two blocks.
template <class T>
HWY_INLINE void describe_pair(Tasks tasks, std::size_t i, PairsOfBlocks<T>& pairs) {
  const PlacedBlock<T>* const* both = pairs.block[i];
  const std::size_t of_b =
      (static_cast<std::size_t>(both[0]->radius <= both[1]->radius) & tasks.of_larger) | tasks.of_b;
  const PlacedBlock<T>& one = *both[of_b];  // no branch: it would be unpredictable
  const PlacedBlock<T>& many = *both[1 - of_b];
  pairs.one[i] = one.spheres;
  pairs.many[i] = many.spheres;
  pairs.lever[i] = many.lever;
  subtract(many.centre, one.origin, pairs.ball[i]);
  subtract(one.origin, many.origin, pairs.offset[i]);
  const T error = one.error + many.error;
  pairs.ball_reach[i] = many.radius + error;
  static constexpr T kSign[2] = {1, -1};
  pairs.error[i] = error * kSign[of_b];
}

/// Places the spheres of pair `i` and lists those that reach the other's leaf ball: all, or lane
/// `single` if that is not negative. Returns the number of tasks listed so far.
template <class T>
HWY_INLINE std::size_t list_tasks(PairsOfBlocks<T>& pairs, std::size_t i, int single,
                                  std::size_t listed) {
  const LaneTag<T> d;
  const Spheres<T>& spheres = *pairs.one[i];
  const auto reach = hn::Set(d, pairs.ball_reach[i]);
  const auto error = hn::Abs(hn::Set(d, pairs.error[i]));
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const std::size_t at = kWidth * i + lane;
    const auto x = hn::Load(d, spheres.x + lane);
    const auto y = hn::Load(d, spheres.y + lane);
    const auto z = hn::Load(d, spheres.z + lane);
    const auto r = hn::Load(d, spheres.r + lane);
    const auto dx = x - hn::Set(d, pairs.ball[i][0]);
    const auto dy = y - hn::Set(d, pairs.ball[i][1]);
    const auto dz = z - hn::Set(d, pairs.ball[i][2]);
    const auto sum = r + reach;
    auto near = ((dx * dx + dy * dy) + dz * dz) < sum * sum;
    if (single >= 0)
      near = hn::And(near, hn::Iota(d, static_cast<T>(lane)) == hn::Set(d, static_cast<T>(single)));
    hn::Store(x + hn::Set(d, pairs.offset[i][0]), d, pairs.x + at);
    hn::Store(y + hn::Set(d, pairs.offset[i][1]), d, pairs.y + at);
    hn::Store(z + hn::Set(d, pairs.offset[i][2]), d, pairs.z + at);
    hn::Store(r + (error + error), d, pairs.reach + at);
    listed += append_lanes<T>(d, near, static_cast<std::uint32_t>(at), pairs.task + listed);
  }
  return listed;
}

/// Finds the lanes that tasks overlap, within rounding. Returns the number of tasks with any.
template <class T>
HWY_INLINE std::size_t find_hits(PairsOfBlocks<T>& pairs, std::size_t listed) {
  const LaneTag<T> d;
  std::size_t found = 0;
  for (std::size_t k = 0; k < listed; ++k) {
    const std::size_t at = pairs.task[k];
    const Spheres<T>& spheres = *pairs.many[at / kWidth];
    const auto xi = hn::Set(d, pairs.x[at]);
    const auto yi = hn::Set(d, pairs.y[at]);
    const auto zi = hn::Set(d, pairs.z[at]);
    const auto reach = hn::Set(d, pairs.reach[at]);
    std::uint32_t lanes = 0;
    for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
      const auto dx = hn::Load(d, spheres.x + lane) - xi;
      const auto dy = hn::Load(d, spheres.y + lane) - yi;
      const auto dz = hn::Load(d, spheres.z + lane) - zi;
      const auto sum = hn::Load(d, spheres.r + lane) + reach;
      lanes |= mask_bits(d, ((dx * dx + dy * dy) + dz * dz) < sum * sum) << lane;
    }
    pairs.hits[found] = static_cast<std::uint32_t>(at) << 16 | lanes;
    found += lanes != 0 ? 1 : 0;
  }
  return found;
}

/// Appends the lenses of a task with the lanes that it overlaps.
template <class T>
HWY_INLINE void add_lenses(const PairsOfBlocks<T>& pairs, std::uint32_t hits, bool binned,
                           LensList<T>& list) {
  const LaneTag<T> d;
  const std::size_t at = hits >> 16;
  const std::size_t i = at / kWidth;
  const Spheres<T>& spheres = *pairs.many[i];
  const T* const lever = pairs.lever[i];
  const auto xi = hn::Set(d, pairs.x[at]);
  const auto yi = hn::Set(d, pairs.y[at]);
  const auto zi = hn::Set(d, pairs.z[at]);
  const auto ri = hn::Set(d, pairs.one[i]->r[at % kWidth]);
  const auto lx = xi + hn::Set(d, lever[0]);
  const auto ly = yi + hn::Set(d, lever[1]);
  const auto lz = zi + hn::Set(d, lever[2]);
  const auto error = hn::Set(d, pairs.error[i]);
  const std::size_t before = list.size;
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const Compressor compress(d, mask_of_bits(d, (hits & 0xffff) >> lane));
    const auto rj = hn::Load(d, spheres.r + lane);
    const auto dx = hn::Load(d, spheres.x + lane) - xi;
    const auto dy = hn::Load(d, spheres.y + lane) - yi;
    const auto dz = hn::Load(d, spheres.z + lane) - zi;
    const std::size_t end = list.size;
    hn::StoreU(compress(dx), d, list.dx + end);
    hn::StoreU(compress(dy), d, list.dy + end);
    hn::StoreU(compress(dz), d, list.dz + end);
    hn::StoreU(compress(rj), d, list.rj + end);
    hn::StoreU(ri, d, list.ri + end);
    hn::StoreU(lx, d, list.lx + end);
    hn::StoreU(ly, d, list.ly + end);
    hn::StoreU(lz, d, list.lz + end);
    hn::StoreU(error, d, list.error + end);
    list.size += compress.count();
  }
  if (binned) std::fill(list.bin + before, list.bin + list.size, pairs.bin[i]);
}

/// Appends the lenses of two tasks, which together overlap at most sixteen lanes, with half the
/// stores. Requires vectors of sixteen lanes.
template <class T>
HWY_INLINE void add_two(const PairsOfBlocks<T>& pairs, std::uint32_t hits_1, std::uint32_t hits_2,
                        LensList<T>& list) {
  const LaneTag<T> d;
  static_assert(hn::MaxLanes(d) == kWidth);
  const hn::RebindToUnsigned<decltype(d)> du;
  using V = hn::Vec<decltype(d)>;
  const std::size_t at_1 = hits_1 >> 16, at_2 = hits_2 >> 16;
  const std::size_t i_1 = at_1 / kWidth, i_2 = at_2 / kWidth;
  const auto lanes_1 = hn::RebindMask(du, mask_of_bits(d, hits_1 & 0xffff));
  const auto lanes_2 = hn::RebindMask(du, mask_of_bits(d, hits_2 & 0xffff));
  const std::size_t count_1 = hn::CountTrue(du, lanes_1);
  const std::size_t count_2 = hn::CountTrue(du, lanes_2);
  const auto later = mask_of_bits(d, 0xffffu << count_1 & 0xffffu);
  const auto numbers = hn::Load(du, kLaneNumbers);
  // The second task's lanes follow the first one's.
  const auto moved = hn::IndicesFromVec(du, hn::LoadU(du, kLateLanes + kWidth - count_1));
  const auto from = hn::IndicesFromVec(
      d, hn::IfThenElse(hn::RebindMask(du, later),
                        hn::TableLookupLanes(hn::Compress(numbers, lanes_2), moved),
                        hn::Compress(numbers, lanes_1)));
  const auto of_lanes = [&](const T* x_1, const T* x_2) -> V {
    return hn::IfThenElse(later, hn::TableLookupLanes(hn::Load(d, x_2), from),
                          hn::TableLookupLanes(hn::Load(d, x_1), from));
  };
  const auto of_tasks = [&](T x_1, T x_2) -> V {
    return hn::IfThenElse(later, hn::Set(d, x_2), hn::Set(d, x_1));
  };
  const Spheres<T>& many_1 = *pairs.many[i_1];
  const Spheres<T>& many_2 = *pairs.many[i_2];
  const auto xi = of_tasks(pairs.x[at_1], pairs.x[at_2]);
  const auto yi = of_tasks(pairs.y[at_1], pairs.y[at_2]);
  const auto zi = of_tasks(pairs.z[at_1], pairs.z[at_2]);
  const T* const lever_1 = pairs.lever[i_1];
  const T* const lever_2 = pairs.lever[i_2];
  const std::size_t end = list.size;
  hn::StoreU(of_lanes(many_1.x, many_2.x) - xi, d, list.dx + end);
  hn::StoreU(of_lanes(many_1.y, many_2.y) - yi, d, list.dy + end);
  hn::StoreU(of_lanes(many_1.z, many_2.z) - zi, d, list.dz + end);
  hn::StoreU(of_lanes(many_1.r, many_2.r), d, list.rj + end);
  hn::StoreU(of_tasks(pairs.one[i_1]->r[at_1 % kWidth], pairs.one[i_2]->r[at_2 % kWidth]), d,
             list.ri + end);
  hn::StoreU(xi + of_tasks(lever_1[0], lever_2[0]), d, list.lx + end);
  hn::StoreU(yi + of_tasks(lever_1[1], lever_2[1]), d, list.ly + end);
  hn::StoreU(zi + of_tasks(lever_1[2], lever_2[2]), d, list.lz + end);
  hn::StoreU(of_tasks(pairs.error[i_1], pairs.error[i_2]), d, list.error + end);
  list.size = end + count_1 + count_2;
}

/// Tasks that overlap too many lanes for add_two(). Not inlined, as it is rare and costs registers.
template <class T>
HWY_NOINLINE void add_apart(const PairsOfBlocks<T>& pairs, std::uint32_t hits_1,
                            std::uint32_t hits_2, bool binned, LensList<T>& list) {
  add_lenses(pairs, hits_1, binned, list);
  add_lenses(pairs, hits_2, binned, list);
}

/// Appends the lenses of two tasks, in the same order for every vector width.
template <class T>
HWY_INLINE void add_both(const PairsOfBlocks<T>& pairs, std::uint32_t hits_1, std::uint32_t hits_2,
                         bool binned, LensList<T>& list) {
  if constexpr (kCompressInstruction<LaneTag<T>>) {
    const std::size_t count_1 = hwy::PopCount(hits_1 & 0xffff);
    if (count_1 + hwy::PopCount(hits_2 & 0xffff) > kWidth)
      return add_apart(pairs, hits_1, hits_2, binned, list);
    std::uint32_t* const bins = list.bin + list.size;
    add_two(pairs, hits_1, hits_2, list);
    if (!binned) return;
    std::fill(bins, bins + count_1, pairs.bin[(hits_1 >> 16) / kWidth]);
    std::fill(bins + count_1, list.bin + list.size, pairs.bin[(hits_2 >> 16) / kWidth]);
  } else {
    add_lenses(pairs, hits_1, binned, list);
    add_lenses(pairs, hits_2, binned, list);
  }
}

/// add_leaf_pairs() in T: a few pairs at a time go through all stages.
template <class T>
void add_as(const LeafStage& stage, PlacedBlocks<T>& blocks, const std::uint32_t* a,
            const std::uint32_t* b, std::size_t n, LeafSums& sums) {
  const TurnedAxes<T> axes(*stage.a_from_b);
  LeafSums* const bins = stage.bins.sums;
  const bool single_a = stage.level_a == kSphereLevel;
  const bool single_b = stage.level_b == kSphereLevel;
  const Tasks tasks{!single_a && !single_b ? 1u : 0u, single_b ? 1u : 0u};
  const int shift_a = single_a ? kWidthBits : 0;  // from spheres to blocks
  const int shift_b = single_b ? kWidthBits : 0;
  const auto place_a = [&](std::uint32_t block, PlacedBlock<T>& placed) {
    place_block(*stage.a, block, axes, placed);
  };
  const auto turn_b = [&](std::uint32_t block, PlacedBlock<T>& placed) {
    turn_block(*stage.b, block, axes, placed);
  };
  PairsOfBlocks<T> pairs;
  LensList<T> list;
  std::size_t done = 0;
  while (done < n) {
    const std::size_t most = std::min(kPairsAtOnce, n - done);
    std::size_t taken = 0;
    for (; taken < most; ++taken) {
      const PlacedBlock<T>** const both = pairs.block[taken];
      both[0] = blocks.a.find(a[done + taken] >> shift_a, pairs.block[0], 2 * taken, place_a);
      both[1] = blocks.b.find(b[done + taken] >> shift_b, pairs.block[0], 2 * taken, turn_b);
      if (both[0] == nullptr || both[1] == nullptr) break;
    }
    for (std::size_t i = 0; i < taken; ++i) describe_pair(tasks, i, pairs);
    std::size_t listed = 0;
    for (std::size_t i = 0; i < taken; ++i) {
      const int single = single_a   ? static_cast<int>(a[done + i] % kWidth)
                         : single_b ? static_cast<int>(b[done + i] % kWidth)
                                    : -1;
      listed = list_tasks(pairs, i, single, listed);
    }
    if (bins != nullptr)
      for (std::size_t i = 0; i < taken; ++i)
        pairs.bin[i] = stage.bins.node[done + i] >> stage.bins.shift;
    done += taken;
    const std::size_t found = find_hits(pairs, listed);
    if (found % 2 != 0) pairs.hits[found] = pairs.hits[found - 1] & 0xffff0000;  // overlaps none
    for (std::size_t k = 0; k < found; k += 2) {
      add_both(pairs, pairs.hits[k], pairs.hits[k + 1], bins != nullptr, list);
      if (list.size >= kFullList) sum_full_list(list, sums, bins);
    }
  }
  sum_last_lenses(list, sums, bins);
}

void add_pairs(const LeafStage& stage, LeafScratch& scratch, const std::uint32_t* a,
               const std::uint32_t* b, std::size_t n, LeafSums& sums) {
  stage.precision == Precision::float32 ? add_as<float>(stage, scratch.float32, a, b, n, sums)
                                        : add_as<double>(stage, scratch.float64, a, b, n, sums);
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(add_pairs);

void add_leaf_pairs(const LeafStage& stage, LeafScratch& scratch, const std::uint32_t* a,
                    const std::uint32_t* b, std::size_t n, LeafSums& sums) noexcept {
  HWY_DYNAMIC_DISPATCH(add_pairs)(stage, scratch, a, b, n, sums);
}

}  // namespace ist
#endif
