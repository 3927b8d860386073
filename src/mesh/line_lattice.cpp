#include "mesh/line_lattice.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cstddef>

#include "mesh/winding.h"

namespace ist {
namespace {

/// Calls visit(line, crossing) for every crossing of the mesh, from many threads.
template <class Visit>
void for_crossings(const MeshView& mesh, const LineLattice& lattice, const Visit& visit) {
  const auto row = [&](const Corners& t, std::uint32_t j) {
    const LatticeRange lines = lines_of(lattice, t, j);
    for (std::uint32_t i = lines.first; i < lines.last; ++i) {
      const Crossing crossing = crossing_of(lattice, t, i, j);
      if (crossing.sign != 0) visit(std::size_t{j} * lattice.ny + i, crossing);
    }
  };
  tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count, [&](std::uint32_t triangle) {
    const Corners t = corners_of(mesh, triangle);
    const LatticeRange rows = rows_of(lattice, t);
    constexpr std::uint32_t kManyRows = 64;
    if (rows.first + kManyRows < rows.last) {
      tbb::parallel_for(rows.first, rows.last, [&](std::uint32_t j) { row(t, j); });
    } else {
      for (std::uint32_t j = rows.first; j < rows.last; ++j) row(t, j);
    }
  });
}

std::uint32_t add_one(std::uint32_t& count) {
  return std::atomic_ref<std::uint32_t>(count).fetch_add(1, std::memory_order_relaxed);
}

}  // namespace

LatticeCrossings cross_lattice(const MeshView& mesh, const LineLattice& lattice) {
  LatticeCrossings result;
  const std::size_t lines = lattice.lines();
  std::vector<std::uint32_t>& first = result.first;
  first.resize(lines + 1);
  for_crossings(mesh, lattice,
                [&](std::size_t line, const Crossing&) { add_one(first[line + 1]); });
  for (std::size_t line = 0; line < lines; ++line) first[line + 1] += first[line];
  result.crossings.resize(first.back());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for_crossings(mesh, lattice, [&](std::size_t line, const Crossing& crossing) {
    result.crossings[add_one(next[line])] = crossing;
  });
  // Threads append in any order; sorted, nothing of it is left.
  tbb::parallel_for(std::size_t{0}, lines, [&](std::size_t line) {
    std::sort(result.crossings.begin() + first[line], result.crossings.begin() + first[line + 1],
              comes_before);
  });
  return result;
}

}  // namespace ist
