#include "mesh/winding.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "mesh/line_lattice.h"
#include "mesh/triangles_in_box.h"

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

ItemGroups<std::uint32_t, Crossing> line_crossings(
    const MeshView& mesh, const std::vector<std::array<double, 2>>& lines) {
  // The lines by square cells, as many as there are lines. A coordinate's cell never falls when it
  // grows.
  const auto cells = static_cast<std::size_t>(std::sqrt(static_cast<double>(lines.size()))) + 1;
  const auto cell_of = [&](const double x) {
    const double n = static_cast<double>(cells);
    return static_cast<std::size_t>(std::clamp((x + 1) / 2 * n, 0.0, n - 1));
  };
  const ItemGroups<> lines_in(cells * cells, [&](const auto& visit) {
    for (std::uint32_t i = 0; i < lines.size(); ++i)
      visit(cell_of(lines[i][1]) * cells + cell_of(lines[i][0]), i);
  });
  tbb::enumerable_thread_specific<std::vector<std::pair<std::uint32_t, Crossing>>> of_threads;
  tbb::parallel_for(
      tbb::blocked_range<std::uint32_t>(0, mesh.triangle_count), [&](const auto& triangles) {
        auto& found = of_threads.local();
        for (std::uint32_t triangle = triangles.begin(); triangle != triangles.end(); ++triangle) {
          const Corners t = corners_of(mesh, triangle);
          const auto low = [&](const int k) {
            return std::min(std::min(t.p[0][k], t.p[1][k]), t.p[2][k]);
          };
          const auto high = [&](const int k) {
            return std::max(std::max(t.p[0][k], t.p[1][k]), t.p[2][k]);
          };
          const double y_low = low(1), y_high = high(1), z_low = low(2), z_high = high(2);
          const std::size_t left = cell_of(y_low), right = cell_of(y_high), last = cell_of(z_high);
          for (std::size_t row = cell_of(z_low); row <= last; ++row) {
            const std::uint32_t end = lines_in.first[row * cells + right + 1];
            for (std::uint32_t i = lines_in.first[row * cells + left]; i < end; ++i) {
              const std::uint32_t line = lines_in.items[i];
              const double* const yz = lines[line].data();
              if (yz[0] < y_low || yz[0] > y_high || yz[1] < z_low || yz[1] > z_high) continue;
              const int facing = pierced(t, yz);
              if (facing != 0) found.push_back({line, {crossing_x(t, yz), -facing}});
            }
          }
        }
      });
  const auto each = [&](const auto& visit) {
    for (const auto& found : of_threads)
      for (const auto& [line, crossing] : found) visit(line, crossing);
  };
  return ItemGroups<std::uint32_t, Crossing>::in_parallel(lines.size(), each, comes_before);
}

}  // namespace ist
