// What triangles in one plane have in common: included once a target.

#if defined(IST_QUERY_FLAT_AREAS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_FLAT_AREAS_INL_H_
#undef IST_QUERY_FLAT_AREAS_INL_H_
#else
#define IST_QUERY_FLAT_AREAS_INL_H_
#endif

#include "query/exact/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// Points in the plane of two coordinates, and an edge between two of them.
struct FlatPoint {
  V x, y;
};
struct FlatEdge {
  V low, high;  ///< of x
  V x, y, slope;
  V turn;  ///< 1 where it goes up in x, -1 where down, 0 where neither

  FlatEdge(const FlatPoint& p, const FlatPoint& q) : x(p.x), y(p.y) {
    const D d;
    const V dx = q.x - p.x;
    low = hn::Min(p.x, q.x);
    high = hn::Max(p.x, q.x);
    const V one = hn::Set(d, 1.0);
    const auto upright = hn::Abs(dx) <= hn::Set(d, 1e-200);
    slope = (q.y - p.y) / hn::IfThenElse(upright, one, dx);
    turn = hn::IfThenZeroElse(upright, hn::CopySign(one, dx));
  }
  V at(V where) const { return y + (where - x) * slope; }
};

/// What triangles in one plane have in common.
struct CommonArea {
  V over_normal;  ///< its area, over the length of A's normal
  Vec3 centre;    ///< seen from A's first corner
};

/// The area that triangles in one plane have in common, over the length of `normal`, A's.
///
/// A triangle is the sum of what lies below its edges, signed by the way they go. What two such
/// areas have in common is the integral of the lower edge, whose parts that do not depend on both
/// edges add up to 0: ∫ min(e − f, 0) over the x of both is left. No side of a point is asked, so
/// edges and corners that coincide are nothing special.
HWY_INLINE CommonArea common_area(const Vec3 (&a)[3], const Vec3 (&b)[3], const Vec3& normal) {
  const D d;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0);
  const V nx = hn::Abs(normal.x), ny = hn::Abs(normal.y), nz = hn::Abs(normal.z);
  const auto by_x = hn::And(nx > ny, nx > nz), by_y = ny > nz;
  const auto one_of = [&](V if_x, V if_y, V if_z) {
    return hn::IfThenElse(by_x, if_x, hn::IfThenElse(by_y, if_y, if_z));
  };
  FlatPoint at[2][3];
  V low = zero, high = zero, left = zero, right = zero;
  for (int s = 0; s < 2; ++s)
    for (int c = 0; c < 3; ++c) {
      const Vec3 r = (s == 0 ? a[c] : b[c]) - a[0];
      at[s][c] = {one_of(r.y, r.z, r.x), one_of(r.z, r.x, r.y)};
      left = hn::Min(left, at[s][c].x);
      right = hn::Max(right, at[s][c].x);
      low = hn::Min(low, at[s][c].y);
      high = hn::Max(high, at[s][c].y);
    }
  V twice = zero, moment_x = zero, moment_y = zero;
  for (int i = 0; i < 3; ++i) {
    const FlatEdge e(at[0][i], at[0][(i + 1) % 3]);
    for (int j = 0; j < 3; ++j) {
      const FlatEdge f(at[1][j], at[1][(j + 1) % 3]);
      const V from = hn::Max(e.low, f.low), to = hn::Min(e.high, f.high);
      // Beside both edges nothing is below.
      const auto over = to > from;
      const V first = hn::IfThenElseZero(over, e.at(from) - f.at(from)),
              last = hn::IfThenElseZero(over, e.at(to) - f.at(to));
      const V below = hn::Max(hn::Neg(first), zero) + hn::Max(hn::Neg(last), zero);
      const V whole = hn::Abs(first) + hn::Abs(last);
      const V share = (to - from) / hn::IfThenElse(whole > zero, whole, one),
              turn = e.turn * f.turn;
      twice = twice + turn * (share * (below * below));
      // ∫ x (e − f) and ∫ (e² − f²) / 2 between the places where e − f is below 0.
      const V root = from + share * hn::Abs(first);
      const V p = hn::IfThenElse(first < zero, from, root),
              q = hn::IfThenElse(last < zero, to, root);
      const V dp = hn::Min(first, zero), dq = hn::Min(last, zero);
      const V at_p = (dp + dp) + dq, at_q = dp + (dq + dq), half = hn::Set(d, 0.5);
      const V mean_p = f.at(p) + half * dp, mean_q = f.at(q) + half * dq;
      const V turned = turn * (p - q);
      moment_x = moment_x + turned * (at_p * p + at_q * q);
      moment_y = moment_y + turned * (at_p * mean_p + at_q * mean_q);
    }
  }
  // What roundings leave of nothing is nothing.
  const V found = hn::Abs(twice), least = hn::Set(d, 1e-14) * ((right - left) * (high - low));
  const V size = one_of(nx, ny, nz);
  const auto counts = hn::And(found > least, size > zero);
  const V divisor = hn::IfThenElse(counts, size, one);
  // The sums are six times the moments, and twice the area.
  const V thrice = hn::Set(d, 3.0) * hn::IfThenElse(counts, twice, one);
  const V x = moment_x / thrice, y = moment_y / thrice;
  // In the plane: the third coordinate is by the normal.
  const V along_x = one_of(normal.y, normal.z, normal.x),
          along_y = one_of(normal.z, normal.x, normal.y);
  const V along = one_of(normal.x, normal.y, normal.z);
  const V z = hn::Neg(along_x * x + along_y * y) / hn::IfThenElse(counts, along, one);
  return {hn::IfThenElseZero(counts, hn::Set(d, 0.5) * found / divisor),
          {one_of(z, y, x), one_of(x, z, y), one_of(y, x, z)}};
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
