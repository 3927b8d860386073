// Heights and feet of ball centres over triangles. Included once per target.

#if defined(IST_QUERY_PROBE_FEET_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_PROBE_FEET_INL_H_
#undef IST_QUERY_PROBE_FEET_INL_H_
#else
#define IST_QUERY_PROBE_FEET_INL_H_
#endif

#include "query/ball_triangle/surface_patch.h"
#include "query/kernel/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// A vector of centres: their heights over triangles' planes, and their feet in these.
template <class V>
struct Feet {
  V height, x, y;
};

/// A bit for each ball that comes near its triangle, which extends from `left` to `right` and from
/// 0 to `top` in its plane. kFeet: stores the feet, from `lane` on.
template <bool kFeet, class V>
HWY_INLINE std::uint32_t near_lanes(const Feet<V>& feet, V left, V right, V top, V r,
                                    std::size_t lane, double* height, double* x, double* y) {
  const LaneTag<double> d;
  const auto beside = hn::And(feet.x > left - r, feet.x < right + r);
  const auto along = hn::And(feet.y > hn::Zero(d) - r, feet.y < top + r);
  if constexpr (kFeet) {
    hn::Store(feet.height, d, height + lane);
    hn::Store(feet.x, d, x + lane);
    hn::Store(feet.y, d, y + lane);
  }
  return mask_bits(d, hn::And(hn::Abs(feet.height) < r, hn::And(beside, along)));
}

/// A bit for each ball that comes near triangle t. kFeet: stores heights and feet of all balls.
template <bool kFeet>
HWY_INLINE std::uint32_t feet_near(const SurfacePatch& patch, std::size_t t,
                                   const ProbeBalls& balls, double* height, double* x, double* y) {
  const LaneTag<double> d;
  using V = hn::Vec<decltype(d)>;
  const auto of = [&](double value) -> V { return hn::Set(d, value); };
  V from[3], u[3], v[3], n[3];
  for (int k = 0; k < 3; ++k) {
    from[k] = of(patch.corner[0][k][t] - balls.origin[k]);
    u[k] = of(patch.u[k][t]), v[k] = of(patch.v[k][t]), n[k] = of(patch.n[k][t]);
  }
  const V left = of(patch.left[t]), right = of(patch.right[t]), top = of(patch.top[t]);
  std::uint32_t near = 0;
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const V px = hn::Load(d, balls.x + lane) - from[0];
    const V py = hn::Load(d, balls.y + lane) - from[1];
    const V pz = hn::Load(d, balls.z + lane) - from[2];
    const V r = hn::Load(d, balls.r + lane);
    const auto dot = [&](const V(&axis)[3]) -> V {
      return (px * axis[0] + py * axis[1]) + pz * axis[2];
    };
    near |=
        near_lanes<kFeet>(Feet<V>{dot(n), dot(u), dot(v)}, left, right, top, r, lane, height, x, y)
        << lane;
  }
  return near;
}

/// A bit for each triangle that the ball comes near. kFeet: as for feet_near().
template <bool kFeet>
HWY_INLINE std::uint32_t feet_of(const SurfacePatch& patch, const double (&centre)[3],
                                 double radius, double* height, double* x, double* y) {
  const LaneTag<double> d;
  using V = hn::Vec<decltype(d)>;
  const V r = hn::Set(d, radius);
  std::uint32_t near = 0;
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const V px = hn::Set(d, centre[0]) - hn::Load(d, patch.corner[0][0] + lane);
    const V py = hn::Set(d, centre[1]) - hn::Load(d, patch.corner[0][1] + lane);
    const V pz = hn::Set(d, centre[2]) - hn::Load(d, patch.corner[0][2] + lane);
    const auto dot = [&](const double(&axis)[3][kWidth]) -> V {
      return (px * hn::Load(d, axis[0] + lane) + py * hn::Load(d, axis[1] + lane)) +
             pz * hn::Load(d, axis[2] + lane);
    };
    near |= near_lanes<kFeet>(Feet<V>{dot(patch.n), dot(patch.u), dot(patch.v)},
                              hn::Load(d, patch.left + lane), hn::Load(d, patch.right + lane),
                              hn::Load(d, patch.top + lane), r, lane, height, x, y)
            << lane;
  }
  return near;
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
