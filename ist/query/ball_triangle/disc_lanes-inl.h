// The formulas of a ball and a triangle for lanes of doubles. Included once per target.

#if defined(IST_QUERY_DISC_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_DISC_LANES_INL_H_
#undef IST_QUERY_DISC_LANES_INL_H_
#else
#define IST_QUERY_DISC_LANES_INL_H_
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using DiscTag = hn::CappedTag<double, 8>;
using Real = hn::Vec<DiscTag>;
HWY_INLINE Real constant(double x) { return hn::Set(DiscTag(), x); }
HWY_INLINE Real negated(Real x) { return hn::Zero(DiscTag()) - x; }
HWY_INLINE Real root(Real x) { return hn::Sqrt(x); }
HWY_INLINE Real lesser(Real x, Real y) { return hn::Min(x, y); }
HWY_INLINE Real greater(Real x, Real y) { return hn::Max(x, y); }
HWY_INLINE Real where_positive(Real x, Real y) {
  return hn::IfThenElse(x > hn::Zero(DiscTag()), y, constant(1.0));
}

/// atan2(y, x) in (−π, π], within a few units in the last place; 0 for the origin. Same bits on
/// every instruction set: only products, quotients and sums in this order.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V angle_of(D d, V y, V x) {
  // atan(t)/t as a polynomial in t² for 0 ≤ t ≤ tan(π/8), within 4e-17: interpolated at Chebyshev's
  // points with sixty digits.
  constexpr double kTerms[11] = {
      1.0,
      -0.3333333333332844,
      0.1999999999885511,
      -0.14285714180976467,
      0.11111106180455946,
      -0.09090773074808414,
      0.07689953496306857,
      -0.06640233930429408,
      0.056883492268090106,
      -0.04348052215716462,
      0.021135373157693246,
  };
  constexpr double kTanEighth = 0.41421356237309503;                     // tan(π/8)
  constexpr double kQuarter = 0.7853981633974483, kHalf = 2 * kQuarter;  // of π
  const V zero = hn::Zero(d);
  const V ax = hn::Abs(x), ay = hn::Abs(y);
  const V more = hn::Max(ax, ay), less = hn::Min(ax, ay);
  const auto wide = less > hn::Set(d, kTanEighth) * more;
  const V below = hn::IfThenElse(wide, more + less, more);
  const V t = hn::IfThenElse(wide, less - more, less) / hn::Max(below, hn::Set(d, 1e-300));
  const V t2 = t * t;
  // Even and odd terms in separate chains: half the latency.
  const V t4 = t2 * t2;
  V even = hn::Set(d, kTerms[10]), odd = hn::Set(d, kTerms[9]);
  for (int k = 8; k >= 0; k -= 2) even = even * t4 + hn::Set(d, kTerms[k]);
  for (int k = 7; k >= 1; k -= 2) odd = odd * t4 + hn::Set(d, kTerms[k]);
  V angle = t * (even + t2 * odd);
  angle = hn::IfThenElse(wide, hn::Set(d, kQuarter) + angle, angle);
  angle = hn::IfThenElse(ay > ax, hn::Set(d, kHalf) - angle, angle);
  angle = hn::IfThenElse(x < zero, hn::Set(d, 4 * kQuarter) - angle, angle);
  return hn::CopySignToAbs(angle, y);
}

#define IST_FORMULA HWY_INLINE
#include "query/ball_triangle/disc_formulas-inl.h"
#undef IST_FORMULA

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
