#include "query/kernel/guess_kernel.h"

#include <algorithm>
#include <numbers>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/kernel/guess_kernel.cpp"
#include <hwy/foreach_target.h>

#include "query/kernel/lens_list-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// Between these no quotient is infinite. Volumes and radii of sound assets lie there; those of
/// damaged ones need not.
template <class T>
inline constexpr T kMostHeld = sizeof(T) == sizeof(float) ? static_cast<T>(1e7)
                                                          : static_cast<T>(1e100);
template <class T>
inline constexpr T kLeastCubes = sizeof(T) == sizeof(float) ? static_cast<T>(1e-30)
                                                            : static_cast<T>(1e-200);

/// 3/4π: one over the volume of the unit ball.
inline constexpr double kPerBall = 0.75 / std::numbers::pi;

template <class T>
void guess_as(const LeafStage& stage, const std::uint32_t* a, const std::uint32_t* b, std::size_t n,
              LeafSums& sums) {
  const LaneTag<T> d;
  using Lenses = LensVectors<hn::Vec<decltype(d)>>;
  const Similarity& map = *stage.a_from_b;
  const double scale = map.scale, cube = scale * scale * scale;
  LensList<T> list;
  alignas(64) T held[kFullList];  ///< volumes below both nodes, by those of unit balls
  for (std::size_t done = 0; done < n;) {
    list.size = std::min(kFullList, n - done);
    for (std::size_t i = 0; i < list.size; ++i, ++done) {
      const NodeBall ball_a = stage.a->ball(stage.level_a, a[done]);
      const NodeBall ball_b = stage.b->ball(stage.level_b, b[done]);
      const double volume_a = stage.a->sums(stage.level_a, a[done]).volume;
      const double volume_b = stage.b->sums(stage.level_b, b[done]).volume * cube;
      double centre_b[3];
      map.apply(ball_b.centre, centre_b);
      list.dx[i] = static_cast<T>(centre_b[0] - ball_a.centre[0]);
      list.dy[i] = static_cast<T>(centre_b[1] - ball_a.centre[1]);
      list.dz[i] = static_cast<T>(centre_b[2] - ball_a.centre[2]);
      list.ri[i] = static_cast<T>(ball_a.r);
      list.rj[i] = static_cast<T>(ball_b.r * scale);
      list.lx[i] = static_cast<T>(ball_a.centre[0] - map.t[0]);
      list.ly[i] = static_cast<T>(ball_a.centre[1] - map.t[1]);
      list.lz[i] = static_cast<T>(ball_a.centre[2] - map.t[2]);
      list.error[i] = 0;
      list.bin[i] = 0;
      held[i] = static_cast<T>(std::min((kPerBall * volume_a) * (kPerBall * volume_b),
                                        static_cast<double>(kMostHeld<T>)));
    }
    const std::size_t used = list.size, batches = fill_up(list);
    std::fill(held + used, held + kWidth * batches, T(0));
    sum_lenses(list, batches, sums, [&](Lenses& lens, std::size_t at) {
      const auto r = hn::Load(d, list.ri + at) * hn::Load(d, list.rj + at);
      const auto cubes = hn::Max((r * r) * r, hn::Set(d, kLeastCubes<T>));
      const auto weight = hn::Load(d, held + at) / cubes;
      lens.caps = lens.caps * weight;
      for (int k = 0; k < 3; ++k) {
        lens.force[k] = lens.force[k] * weight;
        lens.torque[k] = lens.torque[k] * weight;
        lens.moment[k] = lens.moment[k] * weight;
      }
    });
  }
}

void guess_float32(const LeafStage& stage, const std::uint32_t* a, const std::uint32_t* b,
                   std::size_t n, LeafSums& sums) {
  guess_as<float>(stage, a, b, n, sums);
}

void guess_float64(const LeafStage& stage, const std::uint32_t* a, const std::uint32_t* b,
                   std::size_t n, LeafSums& sums) {
  guess_as<double>(stage, a, b, n, sums);
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(guess_float32);
HWY_EXPORT(guess_float64);

void guess_leaf_pairs(const LeafStage& stage, const std::uint32_t* a, const std::uint32_t* b,
                      std::size_t n, LeafSums& sums) noexcept {
  if (stage.precision == Precision::float32) {
    HWY_DYNAMIC_DISPATCH(guess_float32)(stage, a, b, n, sums);
  } else {
    HWY_DYNAMIC_DISPATCH(guess_float64)(stage, a, b, n, sums);
  }
}

}  // namespace ist
#endif
