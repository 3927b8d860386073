// Which spheres of two leaf blocks meet: included once a target.

#if defined(IST_QUERY_LEAF_PAIRS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_LEAF_PAIRS_INL_H_
#undef IST_QUERY_LEAF_PAIRS_INL_H_
#else
#define IST_QUERY_LEAF_PAIRS_INL_H_
#endif

#include "query/kernel/placed_blocks-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// Pairs that go through the stages together: few enough for the nearest cache.
inline constexpr std::size_t kPairsAtOnce = 16;
inline constexpr int kWidthBits = 4;
static_assert(1u << kWidthBits == kWidth);
inline constexpr std::size_t kTaskRoom = kPairsAtOnce * kWidth;

/// Pairs of leaf blocks, as many as go through the stages together. The sixteen spheres of one
/// block, the one of larger spread, are sixteen tasks: each is to meet the sixteen of the other,
/// whose leaf ball fewer of them reach. Task 16 i + l is lane l of pair i.
template <class T>
struct alignas(64) PairsOfBlocks {
  T x[kTaskRoom], y[kTaskRoom], z[kTaskRoom];    ///< from the other block's origin
  T reach[kTaskRoom];                            ///< radius and rounding
  const PlacedBlock<T>* block[kPairsAtOnce][2];  ///< of A and of B
  const Spheres<T>* one[kPairsAtOnce];           ///< the tasks
  const Spheres<T>* many[kPairsAtOnce];          ///< the others
  const T* lever[kPairsAtOnce];                  ///< of the others
  alignas(32) T ball[kPairsAtOnce][4];    ///< the centre of the other's leaf ball from one's origin
  alignas(32) T offset[kPairsAtOnce][4];  ///< one's origin from the other's
  T ball_reach[kPairsAtOnce];             ///< radius of that ball and rounding
  T error[kPairsAtOnce];  ///< bound on the rounding of a distance; negative if the tasks are B's
  std::uint32_t bin[kPairsAtOnce];
  std::uint32_t task[kTaskRoom + kWidth];  ///< that reach the other's leaf ball
  std::uint32_t met[kTaskRoom + 1];        ///< task << 16 | the lanes it meets
};

/// Whose spheres are tasks.
struct Tasks {
  std::size_t of_larger, of_b;  ///< 0 or 1; both 0: A's
};

/// Chooses whose spheres are tasks, and says where the two blocks are.
template <class T>
HWY_INLINE void describe_pair(Tasks tasks, std::size_t i, PairsOfBlocks<T>& pairs) {
  const PlacedBlock<T>* const* both = pairs.block[i];
  const std::size_t of_b =
      (static_cast<std::size_t>(both[0]->radius <= both[1]->radius) & tasks.of_larger) | tasks.of_b;
  const PlacedBlock<T>& one = *both[of_b];  // no branch: nobody could predict it
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

/// Places the spheres of pair `i` and lists those that come within reach of the other's leaf ball,
/// or only lane `single` of them if that is not negative. Returns the tasks listed so far.
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

/// Finds what the listed tasks meet, or all but meet: its rounding counts too. Returns how many
/// meet anything.
template <class T>
HWY_INLINE std::size_t find_met(PairsOfBlocks<T>& pairs, std::size_t listed) {
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
    pairs.met[found] = static_cast<std::uint32_t>(at) << 16 | lanes;
    found += lanes != 0 ? 1 : 0;
  }
  return found;
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
