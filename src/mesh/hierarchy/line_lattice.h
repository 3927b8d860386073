#pragma once

#include <cmath>

#include "base/host_device.h"
#include "mesh/connectivity/item_groups.h"
#include "mesh/geometry/mesh_view.h"
#include "mesh/geometry/ray_crossing.h"
#include "mesh/geometry/triangle_strip.h"

namespace ist {

constexpr double kGoldenRatio = 0.6180339887498949;  ///< the most irrational fraction of a step

/// Lines along x, evenly spaced: line (i, j) at y(i, j), z(j). They are intersected with a mesh by
/// rasterising its triangles onto the lattice, which needs no hierarchy.
struct LineLattice {
  double y0 = 0, z0 = 0;          ///< lower corner of the lattice, unit frame
  double step_y = 0, step_z = 0;  ///< unit frame, > 0
  double offset = 0;              ///< of the first line from the lower corner, over the step
  double shift = 0;               ///< of every row relative to the one before, over the step
  std::uint32_t ny = 0, nz = 0;   ///< lines in a row, rows

  /// Shift of row j's first line from the lower corner, in steps.
  IST_HD double turned(std::uint32_t j) const {
    const double all = offset + j * shift;
    return shift == 0 ? all : all - static_cast<double>(static_cast<std::int64_t>(all));
  }
  IST_HD double y(std::uint32_t i, std::uint32_t j) const { return y0 + (i + turned(j)) * step_y; }
  IST_HD double z(std::uint32_t j) const { return z0 + (j + offset) * step_z; }
  IST_HD std::uint64_t lines() const { return std::uint64_t{ny} * nz; }
};

/// The indices in 0 … count − 1 whose lines may lie in [low, high], rounding included.
struct LatticeRange {
  std::uint32_t first, last;  ///< [first, last)

  IST_HD LatticeRange(double low, double high, std::uint32_t count) {
    constexpr double kMargin = 1e-6;
    const auto clamped = [count](double x) {
      return static_cast<std::uint32_t>(x > 0 ? (x < count ? x : count) : 0);
    };
    first = clamped(std::ceil(low - kMargin));
    last = clamped(std::floor(high + kMargin) + 1);
  }
};

/// Rows that may meet a triangle.
IST_HD inline LatticeRange rows_of(const LineLattice& lattice, const Corners& t) {
  const Extent z(t, 2);
  return {(z.low - lattice.z0) / lattice.step_z - lattice.offset,
          (z.high - lattice.z0) / lattice.step_z - lattice.offset, lattice.nz};
}

/// Lines of row j that may pierce a triangle.
IST_HD inline LatticeRange lines_of(const LineLattice& lattice, const Corners& t, std::uint32_t j) {
  constexpr double kMargin = 1e-12;  // exceeds the rounding of the following steps
  const double z = lattice.z(j);
  double low = 1e300, high = -1e300;
  for (int k = 0; k < 3; ++k) {
    const double* p = t.p[k];
    const double* q = t.p[(k + 1) % 3];
    if ((p[2] > z) == (q[2] > z)) continue;
    const double y = p[1] + (z - p[2]) / (q[2] - p[2]) * (q[1] - p[1]);
    low = y - kMargin < low ? y - kMargin : low;
    high = y + kMargin > high ? y + kMargin : high;
  }
  if (low > high) return {0, -3, lattice.ny};
  const double first = lattice.y(0, j);
  return {(low - first) / lattice.step_y, (high - first) / lattice.step_y, lattice.ny};
}

/// A triangle in the (y, z) plane in steps of a lattice, seen from row 0 of its line 0.
inline TriangleStrip strip_of(const LineLattice& lattice, const Corners& t) {
  std::array<double, 3> y, z;
  for (std::size_t k = 0; k < 3; ++k) {
    y[k] = (t.p[k][1] - lattice.y0) / lattice.step_y;
    z[k] = (t.p[k][2] - lattice.z0) / lattice.step_z - lattice.offset;
  }
  return {y, z};
}

/// True if a line of row j may lie within; cheaper than lines_of() for needles, where most rows
/// have none.
inline bool may_meet(const TriangleStrip& strip, const LineLattice& lattice, std::uint32_t j) {
  constexpr double kMargin = 2e-6;  // exceeds that of LatticeRange
  const double at = strip.at(j) - lattice.turned(j);
  return static_cast<double>(static_cast<std::int64_t>(at + strip.right + kMargin)) >=
         at + strip.left - kMargin;
}

/// Orders crossings along a line: by x; at equal x, +1 first.
IST_HD inline bool comes_before(const Crossing& a, const Crossing& b) {
  return a.x != b.x ? a.x < b.x : a.sign > b.sign;
}

/// The crossing of a triangle with line (i, j), as line_crossings() computes it; sign 0: none.
IST_HD inline Crossing crossing_of(const LineLattice& lattice, const Corners& t, std::uint32_t i,
                                   std::uint32_t j) {
  const double yz[2] = {lattice.y(i, j), lattice.z(j)};
  const int facing = pierced(t, yz);
  if (facing == 0) return {};
  return {crossing_x(t, yz), -facing};
}

/// The crossings of some rows' lines, in order, one group a line.
using LatticeCrossings = ItemGroups<std::uint64_t, Crossing>;

/// Finds all crossings of a mesh (its arrays suffice) with a lattice: calls visit(j, crossings) for
/// rows from j on, where line (i, j + k) is group k ny + i, until all rows are visited. Stores some
/// 16 million crossings at a time, or those of a row; the lines of needles have billions. Runs on
/// the caller's TBB threads.
void cross_lattice(const MeshView& mesh, const LineLattice& lattice,
                   const std::function<void(std::uint32_t, const LatticeCrossings&)>& visit);

/// Calls visit(line, crossing) for every crossing of a triangle with row j.
template <class Visit>
void for_row(const LineLattice& lattice, const Corners& t, std::uint32_t j, const Visit& visit) {
  const LatticeRange lines = lines_of(lattice, t, j);
  for (std::uint32_t i = lines.first; i < lines.last; ++i) {
    const Crossing crossing = crossing_of(lattice, t, i, j);
    if (crossing.sign != 0) visit(std::size_t{j} * lattice.ny + i, crossing);
  }
}

}  // namespace ist
