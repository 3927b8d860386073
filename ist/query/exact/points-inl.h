// Points whose coordinates are lanes of doubles: included once a target. exact::Point is for one
// double, as functions of a target's instructions are not called from outside of it.

#if defined(IST_QUERY_POINTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_POINTS_INL_H_
#undef IST_QUERY_POINTS_INL_H_
#else
#define IST_QUERY_POINTS_INL_H_
#endif

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
/// No less than its length.
HWY_INLINE V length_bound(const Vec3& a) { return (hn::Abs(a.x) + hn::Abs(a.y)) + hn::Abs(a.z); }
HWY_INLINE V min3(V x, V y, V z) { return hn::Min(x, hn::Min(y, z)); }
HWY_INLINE V max3(V x, V y, V z) { return hn::Max(x, hn::Max(y, z)); }

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
