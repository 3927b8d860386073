#include "scene/body_box.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "scene/box_kernel.cpp"
#include <hwy/foreach_target.h>

#include "query/base/solid_box.h"
#include "query/exact/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

#define IST_FORMULA HWY_INLINE
#include "query/base/rotation_formulas-inl.h"
#undef IST_FORMULA

HWY_INLINE Vec3 load(const double (&from)[3][BodyBlock::kCount], std::size_t i) {
  const D d;
  return {hn::LoadU(d, from[0] + i), hn::LoadU(d, from[1] + i), hn::LoadU(d, from[2] + i)};
}

/// As float_below().
HWY_INLINE hn::Vec<hn::Rebind<float, D>> float_below(V x) {
  const hn::Rebind<float, D> df;
  const auto nearest = hn::DemoteTo(df, x);
  return nearest - hn::Abs(nearest) * hn::Set(df, 1.2e-7f) - hn::Set(df, 1e-37f);
}

HWY_ATTR void place_all(const BodyBlock& block, std::uint32_t lanes, BlockBoxes& boxes) {
  const D d;
  const hn::Rebind<float, D> df;
  boxes.placed = 0;
  for (std::size_t i = 0; i < BodyBlock::kCount; i += hn::Lanes(d)) {
    if ((lanes >> i & ((1u << hn::Lanes(d)) - 1)) == 0) continue;
    const V q0 = hn::LoadU(d, block.q[0] + i), q1 = hn::LoadU(d, block.q[1] + i),
            q2 = hn::LoadU(d, block.q[2] + i), q3 = hn::LoadU(d, block.q[3] + i);
    const V norm = hn::Sqrt((q0 * q0 + q1 * q1) + (q2 * q2 + q3 * q3));
    Mask placed =
        hn::And(norm >= constant(kShortestDirection), norm <= constant(kLongestDirection));
    V w = q0;
    Vec3 v = {q1, q2, q3};
    if (!hn::AllTrue(d, norm == constant(1))) {  // bodies that are not turned skip this
      // (no lane divides by zero, or overflows)
      const V by = hn::IfThenElse(placed, norm, constant(1));
      const auto unit = [&](V q) { return hn::IfThenElseZero(placed, q) / by; };
      w = unit(q0);
      v = {unit(q1), unit(q2), unit(q3)};
    }
    Vec3 low, high;
    box_around(w, v, load(block.t, i), load(block.middle, i), load(block.half, i),
               hn::LoadU(d, block.wider + i), low, high);
    const V most = constant(WorldBox::kMost);
    for (const V x : {low.x, low.y, low.z}) placed = hn::And(placed, x >= hn::Neg(most));
    for (const V x : {high.x, high.y, high.z}) placed = hn::And(placed, x <= most);
    const V lows[3] = {low.x, low.y, low.z}, highs[3] = {high.x, high.y, high.z};
    for (int k = 0; k < 3; ++k) {
      hn::StoreU(float_below(hn::IfThenElseZero(placed, lows[k])), df, boxes.low[k] + i);
      hn::StoreU(hn::Neg(float_below(hn::Neg(hn::IfThenElseZero(placed, highs[k])))), df,
                 boxes.high[k] + i);
    }
    boxes.placed |= mask_bits(d, placed) << i;
  }
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(place_all);

void place_boxes(const BodyBlock& block, std::uint32_t lanes, BlockBoxes& boxes) noexcept {
  HWY_DYNAMIC_DISPATCH(place_all)(block, lanes, boxes);
}

}  // namespace ist
#endif
