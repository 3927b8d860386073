#pragma once

#include <cstdint>

#include <ist/asset_layout.h>

#include "numerics/bits.h"
#include "numerics/host_device.h"
#include "numerics/vec3.h"

// On which side of an edge a way passes, and on which side of a surface a point lies: the same on
// CPU and GPU.

namespace ist {

/// Whether the first number that is not 0 is positive.
IST_HD inline bool first_is_positive(const double (&n)[3]) {
  return n[0] != 0 ? n[0] > 0 : n[1] != 0 ? n[1] > 0 : n[2] > 0;
}

/// On which side of the way from the origin to `d` the edge from a to b passes, where the edge's
/// line goes through the origin: that is moved a little along x, less along y, least along z, and
/// `d` likewise by far more. Turns over with the edge, digit for digit.
IST_HD inline bool passes_left_in_line(const double (&d)[3], const double (&a)[3],
                                       const double (&b)[3]) {
  const double e[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  double turn[3];
  cross(e, d, turn);
  if (turn[0] != 0 || turn[1] != 0 || turn[2] != 0) return first_is_positive(turn);
  // The way runs along the edge.
  if (e[2] != 0) return e[2] < 0;
  return e[1] != 0 ? e[1] > 0 : e[0] > 0;
}

/// The same for any edge. Two triangles that share it see it from opposite sides whatever the
/// rounding, and of edges that meet the way the same moves decide.
IST_HD inline bool passes_left(const double (&d)[3], const double (&a)[3], const double (&b)[3]) {
  double n[3];
  cross(a, b, n);
  const double side = dot(d, n);
  if (side != 0) return side > 0;
  return n[0] != 0 || n[1] != 0 || n[2] != 0 ? first_is_positive(n) : passes_left_in_line(d, a, b);
}

/// Whether the way from the origin to `d` goes through a triangle.
IST_HD inline bool steps_through(const double (&d)[3], const double (&c)[3][3]) {
  const bool left = passes_left(d, c[0], c[1]);
  if (passes_left(d, c[1], c[2]) != left || passes_left(d, c[2], c[0]) != left) return false;
  double e[3], f[3], n[3], past[3];
  for (int k = 0; k < 3; ++k) {
    e[k] = c[1][k] - c[0][k];
    f[k] = c[2][k] - c[0][k];
    past[k] = c[0][k] - d[k];
  }
  cross(e, f, n);
  return (dot(n, c[0]) > 0) != (dot(n, past) > 0);
}

/// Numbers begin … end − 1 of the triangles in a brick's cell, whose bit is among its `surface`.
/// `end_of(i)`: the number after the last of cell i.
struct CellList {
  std::uint32_t begin, end;
};
template <class EndOf>
IST_HD CellList cell_list(const CellBrick& brick, std::uint32_t bit, const EndOf& end_of) {
  const std::uint64_t before = brick.surface & ((std::uint64_t{1} << bit) - 1);
  const std::uint32_t cell = brick.first + static_cast<std::uint32_t>(count_bits(before));
  return {brick.list + (before == 0 ? 0 : end_of(cell - 1)), brick.list + end_of(cell)};
}

/// What a look into the grid tells of a point.
struct CellLook {
  bool inside;     ///< its side, or that of the cell's reference point
  CellList steps;  ///< triangles to step through on the way there; none: `inside` is the point's
  double way[3];
};

/// `grid`: where it lies, what a cell measures and how many bricks it has.
template <class Grid, class EndOf>
IST_HD CellLook look_into_cell(const Grid& grid, const std::uint32_t* brick_index,
                               const CellBrick* bricks, const EndOf& end_of, const double (&x)[3]) {
  CellLook look = {};
  double number[3];
  std::uint32_t brick = 0, bit = 0;
  for (int k = 2; k >= 0; --k) {
    const double at = (x[k] - grid.low[k]) / grid.cell;
    if (!(at >= 0 && at < static_cast<double>(kBrickWidth * grid.bricks[k]))) return look;
    const auto cell = static_cast<std::uint32_t>(at);
    number[k] = static_cast<double>(cell);
    brick = brick * grid.bricks[k] + cell / kBrickWidth;
    bit = bit * kBrickWidth + cell % kBrickWidth;
  }
  const std::uint32_t index = brick_index[brick];
  look.inside = index == kInsideBrick;
  if (index >= kInsideBrick) return look;
  const CellBrick& cells = bricks[index];
  look.inside = (cells.inside >> bit & 1) != 0;
  if ((cells.surface >> bit & 1) == 0) return look;
  look.steps = cell_list(cells, bit, end_of);
  constexpr double kReference[3] = {kCellReference[0], kCellReference[1], kCellReference[2]};
  for (int k = 0; k < 3; ++k)
    look.way[k] = grid.low[k] + (number[k] + kReference[k]) * grid.cell - x[k];
  return look;
}

}  // namespace ist
