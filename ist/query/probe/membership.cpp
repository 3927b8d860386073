#include "query/probe/membership.h"

#include "query/probe/passes_left.h"

namespace ist {
namespace {

struct Vec {
  double x, y, z;
};

Vec operator-(const Vec& a, const Vec& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
double dot(const Vec& a, const Vec& b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }
Vec cross(const Vec& a, const Vec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/// Whether the way from the origin to `d` goes through a triangle.
bool steps_through(const Vec& d, const Vec& a, const Vec& b, const Vec& c) {
  const double to[3] = {d.x, d.y, d.z};
  const double corner[3][3] = {{a.x, a.y, a.z}, {b.x, b.y, b.z}, {c.x, c.y, c.z}};
  const bool left = passes_left(to, corner[0], corner[1]);
  if (passes_left(to, corner[1], corner[2]) != left ||
      passes_left(to, corner[2], corner[0]) != left)
    return false;
  const Vec n = cross(b - a, c - a);
  return (dot(n, a) > 0) != (dot(n, a - d) > 0);
}

}  // namespace

bool inside_surface(const SurfaceTree& surface, const double (&point)[3], double clear) noexcept {
  const FieldHeader& field = *surface.header;
  double cell[3];  // the cell's number along each axis
  std::uint32_t brick = 0, bit = 0;
  for (int k = 2; k >= 0; --k) {
    const double at = (point[k] - field.low[k]) / field.cell;
    if (!(at >= 0 && at < static_cast<double>(kBrickWidth * field.bricks[k]))) return false;
    const auto number = static_cast<std::uint32_t>(at);
    cell[k] = static_cast<double>(number);
    brick = brick * field.bricks[k] + number / kBrickWidth;
    bit = bit * kBrickWidth + number % kBrickWidth;
  }
  const std::uint32_t index = surface.brick_index[brick];
  if (index >= kInsideBrick) return index == kInsideBrick;
  const CellBrick& cells = surface.bricks[index];
  bool inside = (cells.inside >> bit & 1) != 0;
  if ((cells.surface >> bit & 1) == 0) return inside;

  const Vec x{point[0], point[1], point[2]};
  const Vec reference{field.low[0] + (cell[0] + kCellReference[0]) * field.cell,
                      field.low[1] + (cell[1] + kCellReference[1]) * field.cell,
                      field.low[2] + (cell[2] + kCellReference[2]) * field.cell};
  const Vec way = reference - x;
  if (dot(way, way) < clear * clear) return inside;
  const SurfaceTree::CellList list = surface.cell_list(cells, bit);
  for (std::uint32_t i = list.begin; i < list.end; ++i) {
    const std::uint32_t triangle = surface.cell_triangles[i];
    const SurfaceBlock& block = surface.blocks[triangle / kWidth];
    const auto corner = [&](int k) -> Vec {
      const std::uint32_t v = block.corner[k][triangle % kWidth];
      return Vec{static_cast<double>(block.x[v]), static_cast<double>(block.y[v]),
                 static_cast<double>(block.z[v])} -
             x;
    };
    if (steps_through(way, corner(0), corner(1), corner(2))) inside = !inside;
  }
  return inside;
}

}  // namespace ist
