#pragma once

#include <cstdint>

#include "cuda/query/bits.h"
#include "cuda/query/surface_ref.h"
#include "numerics/host_device.h"

// On which side of a surface of triangles points lie: passes_left() and inside_surface()
// (query/probe/) in plain numbers.

namespace ist::gpu {

/// passes_left_in_line(): the edge's line goes through the way's beginning.
IST_HD inline bool passes_left_in_line(const double (&d)[3], const double (&a)[3],
                                       const double (&b)[3]) {
  const double e[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  const double turn[3] = {e[1] * d[2] - e[2] * d[1], e[2] * d[0] - e[0] * d[2],
                          e[0] * d[1] - e[1] * d[0]};
  for (int k = 0; k < 3; ++k)
    if (turn[k] != 0) return turn[k] > 0;
  if (e[2] != 0) return e[2] < 0;
  return e[1] != 0 ? e[1] > 0 : e[0] > 0;
}

/// On which side of the way from the origin to `d` the edge from a to b passes; two triangles that
/// share it agree.
IST_HD inline bool passes_left(const double (&d)[3], const double (&a)[3], const double (&b)[3]) {
  const double n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                       a[0] * b[1] - a[1] * b[0]};
  const double side = (d[0] * n[0] + d[1] * n[1]) + d[2] * n[2];
  if (side != 0) return side > 0;
  for (int k = 0; k < 3; ++k)
    if (n[k] != 0) return n[k] > 0;
  return passes_left_in_line(d, a, b);
}

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
  const bool left = passes_left(way, c[0], c[1]);
  if (passes_left(way, c[1], c[2]) != left || passes_left(way, c[2], c[0]) != left) return false;
  double e[3], f[3], n[3], before = 0, after = 0;
  for (int k = 0; k < 3; ++k) {
    e[k] = c[1][k] - c[0][k];
    f[k] = c[2][k] - c[0][k];
  }
  n[0] = e[1] * f[2] - e[2] * f[1];
  n[1] = e[2] * f[0] - e[0] * f[2];
  n[2] = e[0] * f[1] - e[1] * f[0];
  before = (n[0] * c[0][0] + n[1] * c[0][1]) + n[2] * c[0][2];
  after = (n[0] * (c[0][0] - way[0]) + n[1] * (c[0][1] - way[1])) + n[2] * (c[0][2] - way[2]);
  return (before > 0) != (after > 0);
}

IST_HD inline bool steps_through(const double (&from)[3], const double (&way)[3],
                                 const SurfaceRef& surface, std::uint32_t triangle) {
  return steps_through(from[0], from[1], from[2], way[0], way[1], way[2], surface, triangle);
}

/// What a look into the grid tells of a point.
struct CellLook {
  bool inside;               ///< its side, or that of the cell's reference point
  std::uint32_t begin, end;  ///< triangles to step through on the way there; none: it is told
  double way[3];
};

IST_HD inline CellLook look_into_cell(const SurfaceRef& s, const double (&x)[3]) {
  CellLook look = {};
  double number[3];
  std::uint32_t brick = 0, bit = 0;
  for (int k = 2; k >= 0; --k) {
    const double at = (x[k] - s.low[k]) / s.cell;
    if (!(at >= 0 && at < static_cast<double>(kBrickWidth * s.bricks[k]))) return look;
    const auto cell = static_cast<std::uint32_t>(at);
    number[k] = static_cast<double>(cell);
    brick = brick * s.bricks[k] + cell / kBrickWidth;
    bit = bit * kBrickWidth + cell % kBrickWidth;
  }
  const std::uint32_t index = s.brick_index[brick];
  look.inside = index == kInsideBrick;
  if (index >= kInsideBrick) return look;
  const CellBrick& cells = s.brick_data[index];
  look.inside = (cells.inside >> bit & 1) != 0;
  if ((cells.surface >> bit & 1) == 0) return look;
  const std::uint64_t before = cells.surface & ((std::uint64_t{1} << bit) - 1);
  const std::uint32_t cell = cells.first + static_cast<std::uint32_t>(count_bits(before));
  look.begin = cells.list + (before == 0 ? 0 : s.listed(s.cell_ends, cell - 1));
  look.end = cells.list + s.listed(s.cell_ends, cell);
  constexpr double kReference[3] = {kCellReference[0], kCellReference[1], kCellReference[2]};
  for (int k = 0; k < 3; ++k) look.way[k] = s.low[k] + (number[k] + kReference[k]) * s.cell - x[k];
  return look;
}

/// Whether each lane's point is inside the surface, as inside_surface(). The team goes through the
/// triangles of one lane's cell after another's.
template <class Team>
IST_HD_ONCE bool inside_surface(const Team team, const SurfaceRef& surface, bool wanted,
                                double at_x, double at_y, double at_z) {
  const SurfaceRef& s = *team.memory(&surface);
  const double x[3] = {at_x, at_y, at_z};
  CellLook look = {};
  if (wanted) look = look_into_cell(s, x);
  bool open = look.begin < look.end;
  for (;;) {
    int total = 0;
    const int from = team.first(open, total);
    if (total == 0) return look.inside;
    double point[3], way[3];
    for (int k = 0; k < 3; ++k) {
      point[k] = team.broadcast(x[k], from);
      way[k] = team.broadcast(look.way[k], from);
    }
    const std::uint32_t begin = team.broadcast(look.begin, from);
    const std::uint32_t end = team.broadcast(look.end, from);
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
