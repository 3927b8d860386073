// Points whose coordinates are lanes of doubles. Included once per target. exact::Point has single
// doubles, since functions compiled for one target are not called from outside it.

#if defined(IST_QUERY_POINTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_POINTS_INL_H_
#undef IST_QUERY_POINTS_INL_H_
#else
#define IST_QUERY_POINTS_INL_H_
#endif

#include "query/exact/expansion.h"
#include "query/kernel/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

using D = hn::CappedTag<double, 8>;
using V = hn::Vec<D>;

struct Vec3 {
  V x, y, z;
};

HWY_INLINE Vec3 operator+(const Vec3& a, const Vec3& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
HWY_INLINE Vec3 operator-(const Vec3& a, const Vec3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
HWY_INLINE Vec3 operator*(V s, const Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
HWY_INLINE V dot(const Vec3& a, const Vec3& b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }
HWY_INLINE V absolute_dot(const Vec3& a, const Vec3& size) {
  return (hn::Abs(a.x) * size.x + hn::Abs(a.y) * size.y) + hn::Abs(a.z) * size.z;
}
HWY_INLINE Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
HWY_INLINE V largest(const Vec3& a) {
  return hn::Max(hn::Abs(a.x), hn::Max(hn::Abs(a.y), hn::Abs(a.z)));
}
/// An upper bound of a vector's length.
HWY_INLINE V length_bound(const Vec3& a) { return (hn::Abs(a.x) + hn::Abs(a.y)) + hn::Abs(a.z); }

// The number types of formulas (query/exact/overlap_formulas-inl.h).
using Real = V;
using Mask = hn::Mask<D>;
HWY_INLINE V constant(double x) { return hn::Set(D(), x); }
HWY_INLINE V magnitude(V x) { return hn::Abs(x); }
HWY_INLINE V lesser(V x, V y) { return hn::Min(x, y); }
HWY_INLINE V greater(V x, V y) { return hn::Max(x, y); }
HWY_INLINE Mask less(V x, V y) { return x < y; }
HWY_INLINE Mask at_most(V x, V y) { return x <= y; }
HWY_INLINE Mask equal(V x, V y) { return x == y; }
HWY_INLINE Mask both(Mask x, Mask y) { return hn::And(x, y); }
HWY_INLINE Mask either(Mask x, Mask y) { return hn::Or(x, y); }
HWY_INLINE V choose(Mask of, V x, V y) { return hn::IfThenElse(of, x, y); }

HWY_INLINE V min3(V x, V y, V z) { return hn::Min(x, hn::Min(y, z)); }
HWY_INLINE V max3(V x, V y, V z) { return hn::Max(x, hn::Max(y, z)); }

#define IST_FORMULA HWY_INLINE
#include "query/exact/careful_cross-inl.h"
#include "query/exact/edge_gap_formulas-inl.h"
#include "query/exact/flat_area_formulas-inl.h"
#include "query/exact/overlap_formulas-inl.h"
#include "query/exact/triangle_gap_formulas-inl.h"
#undef IST_FORMULA

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
