#include "mesh/dual_mesh.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <string>

#include <ist/error.h>

#include "mesh/message_text.h"
#include "mesh/polygonise_error.h"
#include "mesh/surface_vertices.h"

namespace ist {
namespace {

using Quad = std::array<std::uint32_t, 4>;  ///< counter-clockwise seen from outside

[[noreturn]] void refuse_gap(const CellGrid& grid, const std::array<std::int32_t, 3>& at) {
  bool border = false;
  for (std::size_t k = 0; k < 3; ++k) border |= at[k] <= 0 || at[k] + 1 >= grid.count[k];
  const std::string place = position_text(grid.point(at[0], at[1], at[2]));
  if (border)
    throw Error("solid: it extends beyond its bounds near " + place + ". Enlarge the bounds");
  throw Error("solid: its signed distance is not 1-Lipschitz near " + place +
              ". Divide it by its largest slope");
}

/// The quad across an edge of two signs, by the vertices of the four cells around it.
Quad quad_across(const std::vector<SurfaceCell>& cells, const CellGrid& grid,
                 const SurfaceCell& owner, int axis) {
  const auto b = static_cast<std::size_t>((axis + 1) % 3),
             c = static_cast<std::size_t>((axis + 2) % 3);
  // Counter-clockwise about the axis; the edge is at the far end of a cell that lies before it.
  constexpr int kBefore[4][2] = {{1, 1}, {0, 1}, {0, 0}, {1, 0}};
  Quad quad{};
  for (std::size_t i = 0; i < 4; ++i) {
    std::array<std::int32_t, 3> at = owner.at;
    at[b] -= kBefore[i][0];
    at[c] -= kBefore[i][1];
    const SurfaceCell* const cell = cell_at(cells, at);
    const int edge = 4 * axis + kBefore[i][0] + 2 * kBefore[i][1];
    if (cell == nullptr || !cell->crosses(edge)) refuse_gap(grid, owner.at);
    quad[i] = cell->first_vertex + cell->loop_of[static_cast<std::size_t>(edge)];
  }
  if ((owner.inside & 1) == 0) std::swap(quad[1], quad[3]);
  return quad;
}

std::vector<Quad> all_quads(const std::vector<SurfaceCell>& cells, const CellGrid& grid) {
  std::vector<Quad> quads;
  for (const SurfaceCell& cell : cells) {
    if (cell.loops == 0) continue;
    // Edges at the lower corner are this cell's; none of two signs may end the grid.
    for (int axis = 0; axis < 3; ++axis)
      if (cell.crosses(4 * axis)) quads.push_back(quad_across(cells, grid, cell, axis));
    for (std::size_t k = 0; k < 3; ++k)
      for (int i = 0; i < 8; ++i)
        if (cell.at[k] + 1 == grid.count[k] && (i >> k & 1) != 0 && (cell.inside >> i & 1) != 0)
          refuse_gap(grid, cell.at);
  }
  return quads;
}

/// Two triangles a quad, by the diagonal whose middle is nearer to the surface.
std::vector<std::array<std::uint32_t, 3>> split(const Solid& solid, const std::vector<Quad>& quads,
                                                const std::vector<Eigen::Vector3d>& vertices) {
  std::vector<std::array<std::uint32_t, 3>> triangles(2 * quads.size());
  tbb::parallel_for(std::size_t{0}, quads.size(), [&](std::size_t q) {
    const Quad& v = quads[q];
    const auto off = [&](std::size_t i, std::size_t j) {
      return std::abs(solid.signed_distance(0.5 * vertices[v[i]] + 0.5 * vertices[v[j]]));
    };
    const std::size_t from = off(0, 2) <= off(1, 3) ? 0 : 1;
    triangles[2 * q] = {v[from], v[from + 1], v[from + 2]};
    triangles[2 * q + 1] = {v[from], v[from + 2], v[(from + 3) % 4]};
  });
  return triangles;
}

}  // namespace

TriangleMesh dual_surface(const Solid& solid, const CellGrid& grid, std::vector<SurfaceCell>& cells,
                          Stage& stage) {
  TriangleMesh mesh;
  mesh.vertices = place_vertices(solid, grid, cells);
  stage.step(0, 0.4);
  mesh.triangles = split(solid, all_quads(cells, grid), mesh.vertices);
  stage.step(0, 0.5);
  return mesh;
}

Polygonised dual_mesh(const Solid& solid, const CellGrid& grid, std::vector<SurfaceCell> cells,
                      Stage& stage) {
  Polygonised result = {dual_surface(solid, grid, cells, stage)};
  result.error = std::max(mesh_to_surface(solid, grid, result.mesh),
                          surface_to_mesh(solid, grid, cells, result.mesh));
  stage.step(0, 1);
  return result;
}

}  // namespace ist
