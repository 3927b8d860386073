#include "mesh/line_lattice.h"

#include <tbb/parallel_for.h>

#include "mesh/exact_triangle.h"

namespace ist {

LatticeCrossings cross_lattice(const MeshView& mesh, const LineLattice& lattice) {
  // Threads share the triangles; where these are few, also their rows.
  const bool is_few = mesh.triangle_count < 4096;
  const auto each = [&](const auto& visit) {
    tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count, [&](std::uint32_t triangle) {
      const Corners t = corners_of(mesh, triangle);
      const LatticeRange rows = rows_of(lattice, t);
      constexpr std::uint32_t kFewRows = 4, kManyRows = 64;
      if (rows.first + kFewRows >= rows.last) {
        for (std::uint32_t j = rows.first; j < rows.last; ++j) for_row(lattice, t, j, visit);
        return;
      }
      const TriangleStrip strip = strip_of(lattice, t);
      const auto row = [&](std::uint32_t j) {
        if (may_meet(strip, lattice, j)) for_row(lattice, t, j, visit);
      };
      if (is_few && rows.first + kManyRows < rows.last) {
        tbb::parallel_for(rows.first, rows.last, row);
      } else {
        for (std::uint32_t j = rows.first; j < rows.last; ++j) row(j);
      }
    });
  };
  return LatticeCrossings::in_parallel(lattice.lines(), each, comes_before);
}

}  // namespace ist
