#include "query/probe/membership.h"

#include "query/probe/sides.h"

namespace ist {

bool inside_surface(const SurfaceTree& surface, const double (&point)[3], double clear) noexcept {
  const CellLook look = look_into_cell(
      *surface.header, surface.brick_index, surface.bricks,
      [&](std::uint32_t cell) { return surface.cell_ends[cell]; }, point);
  bool inside = look.inside;
  if (dot(look.way, look.way) < clear * clear) return inside;
  for (std::uint32_t i = look.steps.begin; i < look.steps.end; ++i) {
    const std::uint32_t triangle = surface.cell_triangles[i];
    const SurfaceBlock& block = surface.blocks[triangle / kWidth];
    double c[3][3];
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t v = block.corner[k][triangle % kWidth];
      c[k][0] = static_cast<double>(block.x[v]) - point[0];
      c[k][1] = static_cast<double>(block.y[v]) - point[1];
      c[k][2] = static_cast<double>(block.z[v]) - point[2];
    }
    if (steps_through(look.way, c)) inside = !inside;
  }
  return inside;
}

}  // namespace ist
