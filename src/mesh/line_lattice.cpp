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
  const auto row = [&](const Corners& t, std::uint32_t j) { for_row(lattice, t, j, visit); };
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

/// Room for the crossings, their counts in first[line + 1]; and where each line's begin.
std::vector<std::uint32_t> make_room(LatticeCrossings& result) {
  std::vector<std::uint32_t>& first = result.first;
  for (std::size_t line = 0; line + 1 < first.size(); ++line) first[line + 1] += first[line];
  result.crossings.resize(first.back());
  return {first.begin(), first.end() - 1};
}

/// All crossings, unsorted, found once and remembered: for lattices of few lines.
void find_once(const MeshView& mesh, const LineLattice& lattice, LatticeCrossings& result) {
  struct Hit {
    std::size_t line;
    Crossing crossing;
  };
  constexpr std::uint32_t kChunk = 2048;  // triangles
  const std::uint32_t count = mesh.triangle_count;
  std::vector<std::vector<Hit>> hits((count + kChunk - 1) / kChunk);
  tbb::parallel_for(std::size_t{0}, hits.size(), [&](std::size_t chunk) {
    const std::uint32_t begin = static_cast<std::uint32_t>(chunk) * kChunk;
    for (std::uint32_t t = begin; t < std::min(begin + kChunk, count); ++t) {
      const Corners corners = corners_of(mesh, t);
      const LatticeRange rows = rows_of(lattice, corners);
      for (std::uint32_t j = rows.first; j < rows.last; ++j)
        for_row(lattice, corners, j, [&](std::size_t line, const Crossing& crossing) {
          hits[chunk].push_back({line, crossing});
        });
    }
  });
  for (const std::vector<Hit>& of_chunk : hits)
    for (const Hit& hit : of_chunk) ++result.first[hit.line + 1];
  std::vector<std::uint32_t> next = make_room(result);
  for (const std::vector<Hit>& of_chunk : hits)
    for (const Hit& hit : of_chunk) result.crossings[next[hit.line]++] = hit.crossing;
}

/// The same, found twice, once to count them: for lattices whose crossings fill the memory.
void find_twice(const MeshView& mesh, const LineLattice& lattice, LatticeCrossings& result) {
  std::vector<std::uint32_t>& first = result.first;
  for_crossings(mesh, lattice,
                [&](std::size_t line, const Crossing&) { add_one(first[line + 1]); });
  std::vector<std::uint32_t> next = make_room(result);
  for_crossings(mesh, lattice, [&](std::size_t line, const Crossing& crossing) {
    result.crossings[add_one(next[line])] = crossing;
  });
}

}  // namespace

LatticeCrossings cross_lattice(const MeshView& mesh, const LineLattice& lattice) {
  constexpr std::size_t kFewLines = std::size_t{1} << 17;
  const std::size_t lines = lattice.lines();
  LatticeCrossings result;
  result.first.resize(lines + 1);
  if (lines <= kFewLines)
    find_once(mesh, lattice, result);
  else
    find_twice(mesh, lattice, result);
  const std::vector<std::uint32_t>& first = result.first;
  // Threads append in any order; sorted, nothing of it is left.
  tbb::parallel_for(std::size_t{0}, lines, [&](std::size_t line) {
    std::sort(result.crossings.begin() + first[line], result.crossings.begin() + first[line + 1],
              comes_before);
  });
  return result;
}

}  // namespace ist
