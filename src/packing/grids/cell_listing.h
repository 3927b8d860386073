#pragma once

#include <cmath>

#include "packing/grids/distance_grid.h"

// A cell within kListMargin of a primitive lists it.
// The tests are the same on every machine, since they determine which cells are active.

namespace ist::packing {

struct CellRange {
  int lo[3], hi[3];  ///< inclusive
  IST_HD std::uint32_t count() const {
    return static_cast<std::uint32_t>(hi[0] - lo[0] + 1) *
           static_cast<std::uint32_t>(hi[1] - lo[1] + 1) *
           static_cast<std::uint32_t>(hi[2] - lo[2] + 1);
  }
};

IST_HD inline CellRange cells_between(const GridLayout& g, Float3 lower, Float3 upper) {
  const float m = 2 * kListMargin;  // without the rounding of the coordinates
  return {{g.at_x(lower.x - m), g.at_y(lower.y - m), g.at_z(lower.z - m)},
          {g.at_x(upper.x + m), g.at_y(upper.y + m), g.at_z(upper.z + m)}};
}

/// A triangle against many cells: its box, its plane and the outlines of its three projections
/// (Schwarz and Seidel 2010), in double.
class TriangleCells {
 public:
  IST_HD TriangleCells(const GridLayout& g, const double* a, const double* b, const double* c)
      : p_{a, b, c} {
    Float3 lower, upper;
    float* const lo[3] = {&lower.x, &lower.y, &lower.z};
    float* const hi[3] = {&upper.x, &upper.y, &upper.z};
    for (int k = 0; k < 3; ++k) {
      const double least = a[k] < b[k] ? (a[k] < c[k] ? a[k] : c[k]) : (b[k] < c[k] ? b[k] : c[k]);
      const double most = a[k] > b[k] ? (a[k] > c[k] ? a[k] : c[k]) : (b[k] > c[k] ? b[k] : c[k]);
      *lo[k] = static_cast<float>(least);
      *hi[k] = static_cast<float>(most);
    }
    range_ = cells_between(g, lower, upper);
    const double e[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const double f[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      normal_[k] = e[i] * f[j] - e[j] * f[i];
    }
    rounding_ = 1e-14 * (std::fabs(e[0]) + std::fabs(e[1]) + std::fabs(e[2])) *
                (std::fabs(f[0]) + std::fabs(f[1]) + std::fabs(f[2]));
  }

  IST_HD const CellRange& range() const { return range_; }

  /// True if a triangle overlaps a cell in range().
  IST_HD bool meets(const GridLayout& g, int i, int j, int k) const {
    const double margin = double{kListMargin};
    const double size = double{g.size} + 2 * margin;
    const double low[3] = {double{g.low_x(i)} - margin, double{g.low_y(j)} - margin,
                           double{g.low_z(k)} - margin};
    // The corners of the cell that are deepest behind the plane and furthest in front of it.
    double behind = 0, before = 0, scale = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double n = normal_[axis], from = low[axis] - p_[0][axis];
      behind += n > 0 ? n * from : n * (from + size);
      before += n > 0 ? n * (from + size) : n * from;
      scale += std::fabs(n);
    }
    const double rounding = 1e-14 * scale + 4 * rounding_;
    if (behind > rounding || before < -rounding) return false;
    for (int axis = 0; axis < 3; ++axis) {                    // projected along this axis
      if (!(std::fabs(normal_[axis]) > rounding_)) continue;  // it projects to an edge
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      const double turn = normal_[axis] > 0 ? 1 : -1;
      for (int edge = 0; edge < 3; ++edge) {
        const double* p = p_[edge];
        const double* q = p_[(edge + 1) % 3];
        const double nu = -turn * (q[v] - p[v]), nv = turn * (q[u] - p[u]);  // inward
        const double farthest = nu * (low[u] - p[u]) + nv * (low[v] - p[v]) +
                                (nu > 0 ? nu * size : 0) + (nv > 0 ? nv * size : 0);
        if (farthest < -1e-14 * (std::fabs(nu) + std::fabs(nv))) return false;
      }
    }
    return true;
  }

 private:
  const double* p_[3];
  double normal_[3];
  double rounding_;  ///< of the normal, and of its product with a unit-frame vector
  CellRange range_;
};

/// A covered cell is so far inside its sphere that no triangle outside the sphere can be listed
/// there.
constexpr float kCoverMargin = 2e-5f;

enum class SphereCell { away, meets, covers };

IST_HD inline CellRange sphere_range(const GridLayout& g, const Sphere& s) {
  return cells_between(g, {s.x - s.r, s.y - s.r, s.z - s.r}, {s.x + s.r, s.y + s.r, s.z + s.r});
}

/// A cell that the surface of the sphere meets lists it; a cell wholly inside is covered.
IST_HD inline SphereCell sphere_cell(const GridLayout& g, const Sphere& s, int i, int j, int k) {
  const float from[3] = {g.low_x(i) - s.x, g.low_y(j) - s.y, g.low_z(k) - s.z};
  float near2 = 0, far2 = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float lo = from[axis] - kListMargin, hi = from[axis] + g.size + kListMargin;
    const float outside = lo > 0 ? lo : (hi < 0 ? -hi : 0.0f);
    const float a = lo < 0 ? -lo : lo, b = hi < 0 ? -hi : hi;
    const float far = a > b ? a : b;
    near2 += outside * outside;
    far2 += far * far;
  }
  const float outer = s.r * 1.000001f + kListMargin;
  const float inner = s.r * 0.99999f - kCoverMargin;
  if (near2 > outer * outer) return SphereCell::away;
  return inner > 0 && far2 < inner * inner ? SphereCell::covers : SphereCell::meets;
}

/// Calls visit(cell id, covered) for every cell of the row (·, j, k) that the sphere meets or
/// covers; the inside of the row only if `covered_too`.
template <class Visit>
IST_HD void for_sphere_row(const GridLayout& g, const Sphere& s, const CellRange& range, int j,
                           int k, bool covered_too, Visit&& visit) {
  // The covered cells are consecutive.
  bool inside = false;
  int last = range.lo[0] - 1;  // the last covered one so far
  for (int i = range.lo[0]; i <= range.hi[0]; ++i) {
    const SphereCell relation = sphere_cell(g, s, i, j, k);
    last = i;
    if (relation == SphereCell::covers) {
      inside = true;
      if (!covered_too) break;
      visit(g.id(i, j, k), true);
    } else if (relation == SphereCell::meets) {
      visit(g.id(i, j, k), false);
    }
  }
  if (!inside || covered_too) return;
  for (int i = range.hi[0]; i > last; --i) {
    const SphereCell relation = sphere_cell(g, s, i, j, k);
    if (relation == SphereCell::covers) return;
    if (relation == SphereCell::meets) visit(g.id(i, j, k), false);
  }
}

}  // namespace ist::packing
