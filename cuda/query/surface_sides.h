#pragma once

#include <cstdint>

#include "cuda/query/surface_ref.h"
#include "numerics/host_device.h"
#include "query/probe/sides.h"

// inside_surface() (query/probe/membership.h) by a team.

namespace ist::gpu {

/// Whether the way from `from` by `way` goes through a triangle of a surface. All by value: what is
/// called by reference lies in memory.
IST_HD_ONCE inline bool steps_through(double from_x, double from_y, double from_z, double way_x,
                                      double way_y, double way_z, const SurfaceRef& surface,
                                      std::uint32_t triangle) {
  const double from[3] = {from_x, from_y, from_z}, way[3] = {way_x, way_y, way_z};
  double c[3][3];
  surface.corners(triangle, c);
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) c[i][k] -= from[k];
  return ist::steps_through(way, c);
}

IST_HD inline bool steps_through(const double (&from)[3], const double (&way)[3],
                                 const SurfaceRef& surface, std::uint32_t triangle) {
  return steps_through(from[0], from[1], from[2], way[0], way[1], way[2], surface, triangle);
}

/// Whether each lane's point is inside the surface, as inside_surface(). The team goes through the
/// triangles of one lane's cell after another's.
template <class Team>
IST_HD_ONCE bool inside_surface(const Team team, const SurfaceRef& surface, bool wanted,
                                double at_x, double at_y, double at_z) {
  const SurfaceRef& s = *team.memory(&surface);
  const double x[3] = {at_x, at_y, at_z};
  CellLook look = {};
  if (wanted)
    look = look_into_cell(
        s, s.brick_index, s.brick_data,
        [&](std::uint32_t cell) { return s.listed(s.cell_ends, cell); }, x);
  bool open = look.steps.begin < look.steps.end;
  for (;;) {
    int total = 0;
    const int from = team.first(open, total);
    if (total == 0) return look.inside;
    double point[3], way[3];
    for (int k = 0; k < 3; ++k) {
      point[k] = team.broadcast(x[k], from);
      way[k] = team.broadcast(look.way[k], from);
    }
    const std::uint32_t begin = team.broadcast(look.steps.begin, from);
    const std::uint32_t end = team.broadcast(look.steps.end, from);
    int steps = 0;
    for (std::uint32_t i = begin + static_cast<std::uint32_t>(team.lane()); i < end;
         i += static_cast<std::uint32_t>(Team::kWidth)) {
      steps += steps_through(point, way, s, s.listed(s.cell_triangles, i)) ? 1 : 0;
    }
    steps = team.sum(steps);
    if (team.lane() == from) {
      look.inside = look.inside != (steps % 2 != 0);
      open = false;
    }
  }
}

template <class Team>
IST_HD bool inside_surface(const Team& team, const SurfaceRef& surface, bool wanted,
                           const double (&x)[3]) {
  return inside_surface(team, surface, wanted, x[0], x[1], x[2]);
}

}  // namespace ist::gpu
