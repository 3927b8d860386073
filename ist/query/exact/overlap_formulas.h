#pragma once

#include <cmath>

#include "base/vec3.h"
#include "query/exact/expansion.h"

// The formulas of an overlap's sums and of triangles' distances for single numbers, on the host and
// on a GPU.

namespace ist::exact {

using Real = double;
using Mask = bool;

IST_HD inline double constant(double x) { return x; }
IST_HD inline double magnitude(double x) { return std::abs(x); }
IST_HD inline double lesser(double x, double y) { return x < y ? x : y; }
IST_HD inline double greater(double x, double y) { return x > y ? x : y; }
IST_HD inline bool less(double x, double y) { return x < y; }
IST_HD inline bool at_most(double x, double y) { return x <= y; }
IST_HD inline bool equal(double x, double y) { return x == y; }
IST_HD inline bool both(bool x, bool y) { return x && y; }
IST_HD inline bool either(bool x, bool y) { return x || y; }
IST_HD inline double choose(bool of, double x, double y) { return of ? x : y; }
/// An upper bound of a vector's length.
IST_HD inline double length_bound(const Vec3& a) {
  return (std::abs(a.x) + std::abs(a.y)) + std::abs(a.z);
}

#define IST_FORMULA IST_HD inline
#include "query/exact/careful_cross-inl.h"
#include "query/exact/edge_gap_formulas-inl.h"
#include "query/exact/flat_area_formulas-inl.h"
#include "query/exact/overlap_formulas-inl.h"
#include "query/exact/triangle_gap_formulas-inl.h"
#undef IST_FORMULA

}  // namespace ist::exact
