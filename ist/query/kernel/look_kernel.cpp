#include "query/kernel/node_kernel.h"

#include <numbers>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/kernel/look_kernel.cpp"
#include <hwy/foreach_target.h>

#include "query/asset/shared_constants.h"
#include "query/kernel/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

inline constexpr std::size_t kMostBalls = 4 * kWidth;

/// Evenly filled balls, in A's axes about the centre of B's root, where floats resolve B's balls.
struct alignas(64) FilledBalls {
  float x[kMostBalls + kWidth], y[kMostBalls + kWidth], z[kMostBalls + kWidth];
  float r[kMostBalls + kWidth];     ///< ≤ 0 in an unused lane
  float fill[kMostBalls + kWidth];  ///< volume of the spheres below over the ball's
  std::size_t count = 0;            ///< a multiple of 16
  float middle[3] = {};             ///< of the root
  float reach = 0;                  ///< radius about `middle` of all balls
};

/// Places the nodes of a tree. `about`: their new origin, A's unit frame.
HWY_INLINE void place(const SphereTree& tree, const Similarity& map, const double (&about)[3],
                      FilledBalls& out) {
  const LaneTag<double> d;
  using V = hn::Vec<decltype(d)>;
  const hn::Rebind<float, decltype(d)> df;
  const NodeBall root = tree.ball(tree.top, 0);
  double middle[3], shift[3];
  map.apply(root.centre, middle);
  for (int k = 0; k < 3; ++k) {
    shift[k] = map.t[k] - about[k];
    out.middle[k] = static_cast<float>(middle[k] - about[k]);
  }
  int at = 0;
  while (at < tree.top && tree.count(at) > kMostBalls) ++at;
  if (at == tree.top) {
    for (std::size_t lane = 0; lane < kWidth; ++lane) {
      out.x[lane] = out.middle[0];
      out.y[lane] = out.middle[1];
      out.z[lane] = out.middle[2];
      out.r[lane] = kEmptyRadius;
      out.fill[lane] = 0;
    }
    out.count = kWidth;
    out.reach = out.r[0] = static_cast<float>(root.r * map.scale);
    out.fill[0] = static_cast<float>(tree.header->volume_sum / ball_volume(root.r));
    return;
  }
  const V scale = hn::Set(d, map.scale), zero = hn::Zero(d), sphere = hn::Set(d, kBallVolume);
  V reach = zero;
  const SphereTree::Level& level = tree.level[at + 1];
  for (std::uint32_t i = 0; i < level.count; ++i) {
    const BallBlock& block = level.blocks[i];
    const Origin& origin = level.origins[i];
    for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
      const V x = load_as<double>(d, block.x + lane) + hn::Set(d, origin.x);
      const V y = load_as<double>(d, block.y + lane) + hn::Set(d, origin.y);
      const V z = load_as<double>(d, block.z + lane) + hn::Set(d, origin.z);
      const V r = load_as<double>(d, block.r + lane);
      V square = zero;
      float* const to[3] = {out.x, out.y, out.z};
      for (int k = 0; k < 3; ++k) {
        const V moved = ((hn::Set(d, map.m[3 * k]) * x + hn::Set(d, map.m[3 * k + 1]) * y) +
                         hn::Set(d, map.m[3 * k + 2]) * z) +
                        hn::Set(d, shift[k]);
        const V between = moved - hn::Set(d, middle[k] - about[k]);
        square = square + between * between;
        hn::Store(hn::DemoteTo(df, moved), df, to[k] + out.count + lane);
      }
      const V placed_r = r * scale;
      reach = hn::Max(reach, hn::Sqrt(square) + placed_r);
      const V fill = load_as<double>(d, level.nodes[i].volume + lane) / (sphere * ((r * r) * r));
      hn::Store(hn::DemoteTo(df, placed_r), df, out.r + out.count + lane);
      hn::Store(hn::DemoteTo(df, fill), df, out.fill + out.count + lane);
    }
    out.count += kWidth;
  }
  out.reach = static_cast<float>(hn::GetLane(hn::MaxOfLanes(d, reach)) * (1 + 1e-6));
}

/// Removes the balls that do not come within the other's reach.
HWY_INLINE void keep_near(const FilledBalls& other, FilledBalls& balls) {
  const LaneTag<float> d;
  using V = hn::Vec<decltype(d)>;
  const V zero = hn::Zero(d), reach = hn::Set(d, other.reach);
  const V mx = hn::Set(d, other.middle[0]), my = hn::Set(d, other.middle[1]),
          mz = hn::Set(d, other.middle[2]);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < balls.count; i += hn::Lanes(d)) {
    const V x = hn::Load(d, balls.x + i), y = hn::Load(d, balls.y + i),
            z = hn::Load(d, balls.z + i);
    const V r = hn::Load(d, balls.r + i), fill = hn::Load(d, balls.fill + i);
    const V dx = x - mx, dy = y - my, dz = z - mz;
    const V limit = hn::Max(r + reach, zero);
    const Compressor compress(d, hn::And(r > zero, (dx * dx + dy * dy) + dz * dz <= limit * limit));
    hn::StoreU(compress(x), d, balls.x + kept);
    hn::StoreU(compress(y), d, balls.y + kept);
    hn::StoreU(compress(z), d, balls.z + kept);
    hn::StoreU(compress(r), d, balls.r + kept);
    hn::StoreU(compress(fill), d, balls.fill + kept);
    kept += compress.count();
  }
  balls.count = kept;
  // Pads the last sixteen with balls that overlap nothing.
  for (std::size_t i = kept; i % kWidth != 0; ++i) {
    balls.x[i] = balls.y[i] = balls.z[i] = balls.fill[i] = 0;
    balls.r[i] = kEmptyRadius;
  }
}

template <class V>
HWY_INLINE double total(V sums, double before) {
  const LaneTag<float> d;
  alignas(64) float lanes[kWidth];
  hn::Store(sums, d, lanes);
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) before += static_cast<double>(lanes[i]);
  return before;
}

/// `lever`: from B's unit-frame origin to the origin of the balls' centres.
template <bool kSlopes>
HWY_INLINE void add_lenses(const FilledBalls& a, const FilledBalls& b, const double (&lever)[3],
                           QuickLook& look) {
  const LaneTag<float> d;
  using V = hn::Vec<decltype(d)>;
  const V zero = hn::Zero(d), two = hn::Set(d, 2.0f), three = hn::Set(d, 3.0f);
  const V one = hn::Set(d, 1.0f), tiny = hn::Set(d, static_cast<float>(kLeastDistance));
  // Each of sixteen lanes adds up in the same order for every vector width.
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    V volume = zero;
    V force[3] = {zero, zero, zero}, torque[3] = {zero, zero, zero};
    for (std::size_t j = 0; j < b.count; ++j) {
      const V bx = hn::Set(d, b.x[j]), by = hn::Set(d, b.y[j]), bz = hn::Set(d, b.z[j]);
      const V br = hn::Set(d, b.r[j]), fill = hn::Set(d, b.fill[j]);
      for (std::size_t i = lane; i < a.count; i += kWidth) {
        const V dx = bx - hn::Load(d, a.x + i);
        const V dy = by - hn::Load(d, a.y + i);
        const V dz = bz - hn::Load(d, a.z + i);
        const V ar = hn::Load(d, a.r + i);
        const V reach = ar + br, step = hn::Abs(ar - br);
        // A contained ball is treated as one that touches the other from inside.
        const V distance = hn::Max(hn::Max(hn::Sqrt((dx * dx + dy * dy) + dz * dz), step), tiny);
        const V depth = hn::Max(reach - distance, zero);
        const V inverse = one / distance;
        const V filled = (fill * hn::Load(d, a.fill + i)) * depth;
        volume = volume +
                 (filled * depth) * ((distance + two * reach) - (three * step) * (step * inverse));
        if constexpr (kSlopes) {
          const V pull =
              (filled * (reach + distance)) *
              (((distance - step) * inverse) * (((distance + step) * inverse) * inverse));
          const V f[3] = {pull * dx, pull * dy, pull * dz};
          const V arm[3] = {bx + hn::Set(d, static_cast<float>(lever[0])),
                            by + hn::Set(d, static_cast<float>(lever[1])),
                            bz + hn::Set(d, static_cast<float>(lever[2]))};
          for (int k = 0; k < 3; ++k) {
            const int l = (k + 1) % 3, m = (k + 2) % 3;
            force[k] = force[k] + f[k];
            torque[k] = torque[k] + (arm[l] * f[m] - arm[m] * f[l]);
          }
        }
      }
    }
    look.volume = total(volume, look.volume);
    if constexpr (kSlopes) {
      for (int k = 0; k < 3; ++k) {
        look.slope.by_translation[k] = total(force[k], look.slope.by_translation[k]);
        look.slope.by_rotation[k] = total(torque[k], look.slope.by_rotation[k]);
      }
    }
  }
}

void look(const SphereTree& a, const SphereTree& b, const Similarity& a_from_b, bool slopes,
          QuickLook& out) {
  const NodeBall root_a = a.ball(a.top, 0), root_b = b.ball(b.top, 0);
  const double reach_a = kPokeOut * root_a.r, reach_b = kPokeOut * (root_b.r * a_from_b.scale);
  // A tiny partner is cheap in double, and floats could not represent both.
  if (!(reach_a > kSpeck * reach_b && reach_b > kSpeck * reach_a)) return;
  double about[3], lever[3], square = 0;
  a_from_b.apply(root_b.centre, about);
  for (int k = 0; k < 3; ++k) {
    lever[k] = about[k] - a_from_b.t[k];
    square += (about[k] - root_a.centre[k]) * (about[k] - root_a.centre[k]);
  }
  if (!(square < (reach_a + reach_b) * (reach_a + reach_b))) return;
  FilledBalls balls_a, balls_b;
  place(a, Similarity::identity(), about, balls_a);
  place(b, a_from_b, about, balls_b);
  keep_near(balls_a, balls_b);
  if (balls_b.count == 0) return;
  keep_near(balls_b, balls_a);
  if (slopes) {
    add_lenses<true>(balls_a, balls_b, lever, out);
  } else {
    add_lenses<false>(balls_a, balls_b, lever, out);
  }
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(look);

QuickLook quick_look(const SphereTree& a, const SphereTree& b, const Similarity& a_from_b,
                     bool slopes) noexcept {
  QuickLook result;
  HWY_DYNAMIC_DISPATCH(look)(a, b, a_from_b, slopes, result);
  // Factors that the sums leave out.
  constexpr double kTwelfth = std::numbers::pi / 12;
  result.volume *= kTwelfth;
  result.slope.by_translation = (-3 * kTwelfth) * result.slope.by_translation;
  result.slope.by_rotation = (-3 * kTwelfth) * result.slope.by_rotation;
  return result;
}

}  // namespace ist
#endif
