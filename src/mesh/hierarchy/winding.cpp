#include "mesh/hierarchy/winding.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "mesh/hierarchy/line_lattice.h"
#include "mesh/hierarchy/triangles_in_box.h"

namespace ist {

int winding_number(const MeshView& mesh, const double p[3]) {
  int winding = 0;
  const RayBox box = RayBox::ray(p);
  none_about_box(mesh, box.lower, box.upper, [&](const Corners& t) {
    winding += ray_winding(t, p);
    return false;
  });
  return winding;
}

void line_crossings(const MeshView& mesh, double y, double z, std::vector<Crossing>& out) {
  out.clear();
  const double yz[2] = {y, z};
  const RayBox box = RayBox::line(y, z);
  none_about_box(mesh, box.lower, box.upper, [&](const Corners& t) {
    const int facing = pierced(t, yz);
    if (facing != 0) out.push_back({crossing_x(t, yz), -facing});
    return false;
  });
  std::sort(out.begin(), out.end(), comes_before);
}

namespace {

/// Lines (y, z) by the square cells that they lie in, as many cells as lines.
class LinesInCells {
 public:
  explicit LinesInCells(const std::vector<std::array<double, 2>>& lines)
      : cells_(static_cast<std::size_t>(std::sqrt(static_cast<double>(lines.size()))) + 1),
        lines_(cells_ * cells_, [&](const auto& visit) {
          for (std::uint32_t i = 0; i < lines.size(); ++i)
            visit(cell_of(lines[i][1]) * cells_ + cell_of(lines[i][0]), i);
        }) {}

  /// Calls visit(line) for all lines within the extents, and for some others.
  template <class Visit>
  void for_each(const Extent& y, const Extent& z, const Visit& visit) const {
    const std::size_t left = cell_of(y.low), right = cell_of(y.high), last = cell_of(z.high);
    for (std::size_t row = cell_of(z.low); row <= last; ++row) {
      const std::uint32_t end = lines_.first[row * cells_ + right + 1];
      for (std::uint32_t i = lines_.first[row * cells_ + left]; i < end; ++i)
        visit(lines_.items[i]);
    }
  }

 private:
  /// Never falls as the coordinate grows.
  std::size_t cell_of(const double x) const {
    const auto n = static_cast<double>(cells_);
    return static_cast<std::size_t>(std::clamp((x + 1) / 2 * n, 0.0, n - 1));
  }

  std::size_t cells_;  ///< along each side of the cube
  ItemGroups<> lines_;
};

}  // namespace

ItemGroups<std::uint32_t, Crossing> line_crossings(
    const MeshView& mesh, const std::vector<std::array<double, 2>>& lines) {
  const LinesInCells in_cells(lines);
  tbb::enumerable_thread_specific<std::vector<std::pair<std::uint32_t, Crossing>>> of_threads;
  tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count, [&](const std::uint32_t triangle) {
    const Corners t = corners_of(mesh, triangle);
    const Extent y(t, 1), z(t, 2);
    in_cells.for_each(y, z, [&](const std::uint32_t line) {
      const double* const yz = lines[line].data();
      if (yz[0] < y.low || yz[0] > y.high || yz[1] < z.low || yz[1] > z.high) return;
      const int facing = pierced(t, yz);
      if (facing != 0) of_threads.local().push_back({line, {crossing_x(t, yz), -facing}});
    });
  });
  const auto each = [&](const auto& visit) {
    for (const auto& found : of_threads)
      for (const auto& [line, crossing] : found) visit(line, crossing);
  };
  return ItemGroups<std::uint32_t, Crossing>::in_parallel(lines.size(), each, comes_before);
}

}  // namespace ist
