#include "mesh/hierarchy/line_lattice.h"

#include <tbb/parallel_for.h>
#include <algorithm>

#include "mesh/geometry/exact_triangle.h"

namespace ist {
namespace {

/// The crossings of rows [from, to): line (i, j) is group (j − from) ny + i.
LatticeCrossings cross_rows(const MeshView& mesh, const LineLattice& lattice, std::uint32_t from,
                            std::uint32_t to) {
  // Threads share the triangles and, if these are few, also their rows.
  const bool is_few = mesh.triangle_count < 4096;
  const auto each = [&](const auto& visit) {
    const auto here = [&](std::size_t line, const Crossing& crossing) {
      visit(line - std::size_t{from} * lattice.ny, crossing);
    };
    tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count, [&](std::uint32_t triangle) {
      const Corners t = corners_of(mesh, triangle);
      LatticeRange rows = rows_of(lattice, t);
      rows.first = std::max(rows.first, from);
      rows.last = std::min(rows.last, to);
      constexpr std::uint32_t kFewRows = 4, kManyRows = 64;
      if (rows.first + kFewRows >= rows.last) {
        for (std::uint32_t j = rows.first; j < rows.last; ++j) for_row(lattice, t, j, here);
        return;
      }
      const TriangleStrip strip = strip_of(lattice, t);
      const auto row = [&](std::uint32_t j) {
        if (may_meet(strip, lattice, j)) for_row(lattice, t, j, here);
      };
      if (is_few && rows.first + kManyRows < rows.last) {
        tbb::parallel_for(rows.first, rows.last, row);
      } else {
        for (std::uint32_t j = rows.first; j < rows.last; ++j) row(j);
      }
    });
  };
  return LatticeCrossings::in_parallel(std::size_t{to - from} * lattice.ny, each, comes_before);
}

/// The approximate number of crossings of all lines: how often the triangles cover a cell.
double expected_crossings(const MeshView& mesh, const LineLattice& lattice) {
  double doubled = 0;
  for (std::uint32_t triangle = 0; triangle < mesh.triangle_count; ++triangle) {
    const Corners t = corners_of(mesh, triangle);
    double normal[3];
    area_normal(t.p[0], t.p[1], t.p[2], normal);
    doubled += std::abs(normal[0]);
  }
  return doubled / 2 / (lattice.step_y * lattice.step_z);
}

}  // namespace

void cross_lattice(const MeshView& mesh, const LineLattice& lattice,
                   const std::function<void(std::uint32_t, const LatticeCrossings&)>& visit) {
  constexpr double kAtOnce = 1 << 24;
  const double parts = std::ceil(expected_crossings(mesh, lattice) / kAtOnce);
  const auto rows = static_cast<std::uint32_t>(std::max(1.0, lattice.nz / std::max(1.0, parts)));
  for (std::uint32_t from = 0; from < lattice.nz; from += rows)
    visit(from, cross_rows(mesh, lattice, from, std::min(from + rows, lattice.nz)));
}

}  // namespace ist
