#include "bake/field/field.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <ist/error.h>

#include "bake/field/field_error.h"
#include "bake/field/field_hierarchy.h"
#include "bake/field/field_mesh.h"
#include "bake/field/sign_grid.h"
#include "bake/field/solid_surface.h"
#include "bake/field/surface_area.h"
#include "bake/field/surface_blocks.h"
#include "bake/field/vertex_clusters.h"

namespace ist {
namespace {

/// A surface and how far it is from the solid's, unit frame.
struct Approximation {
  FieldMesh mesh;
  double error = 0;
};

/// The triangles themselves over vertices rounded to float: no point moves further than a vertex.
Approximation own_triangles(const MeshView& surface) {
  Approximation out;
  out.mesh.vertices.resize(surface.vertex_count);
  for (std::size_t v = 0; v < out.mesh.vertices.size(); ++v) {
    double moved2 = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double exact = surface.vertices[3 * v + k];
      const auto rounded = static_cast<float>(exact);
      out.mesh.vertices[v][k] = rounded;
      moved2 += (exact - double{rounded}) * (exact - double{rounded});
    }
    out.error = std::max(out.error, std::sqrt(moved2) * (1 + 1e-12));
  }
  out.mesh.triangles.resize(surface.triangle_count);
  for (std::size_t t = 0; t < out.mesh.triangles.size(); ++t)
    std::copy_n(surface.triangles + 3 * t, 3, out.mesh.triangles[t].begin());
  reduce(out.mesh);
  return out;
}

/// The cell that leaves at most, and nearly, so many triangles.
double cell_for(const MeshView& surface, std::size_t triangles) {
  // A surface of area A spans about 3 A / cell² triangles; none that fit: the whole solid.
  double cell = std::sqrt(3 * surface_area(surface) / static_cast<double>(triangles));
  double best = 4;
  for (int attempt = 0; attempt < 8; ++attempt) {
    cell = std::clamp(cell, kSmallestCell, 4.0);
    const auto found = static_cast<double>(clustered_triangles(surface, cell));
    const double ratio = found / static_cast<double>(triangles);
    if (ratio <= 1) best = std::min(best, cell);
    if (ratio <= 1 && ratio > 0.93) break;
    cell *= std::clamp(std::sqrt(ratio / 0.97), 0.5, 2.0);
  }
  return best;
}

Approximation clustered(SolidSurface& surface, double cell) {
  Clustered clusters = cluster_vertices(surface.arrays(), cell);
  if (clusters.mesh.triangles.empty()) return {std::move(clusters.mesh), HUGE_VAL};
  const FieldHierarchy hierarchy(clusters.mesh);
  const double error = proven_error(surface.view(), clusters.mesh, hierarchy, clusters.vertex_of);
  return {std::move(clusters.mesh), error};
}

/// The coarsest clusters found that keep within the error; nothing where none were.
std::optional<Approximation> clustered_within(SolidSurface& surface, double max_error) {
  std::optional<Approximation> best;
  double fine = 0, coarse = HUGE_VAL;
  double cell = cell_for(surface.arrays(), kFieldTriangles);
  for (int attempt = 0; attempt < 8 && cell >= kSmallestCell && coarse > 1.05 * fine; ++attempt) {
    Approximation tried = clustered(surface, cell);
    const double ratio = max_error / tried.error;
    if (tried.error <= max_error) {
      fine = cell;
      best = std::move(tried);
    } else {
      coarse = cell;
    }
    // The error of a smooth surface goes with the square of the cell.
    cell *= std::clamp(0.97 * std::sqrt(ratio), 0.125, 8.0);
    if (fine > 0 && coarse < HUGE_VAL && !(cell > fine && cell < coarse))
      cell = std::sqrt(fine * coarse);
    cell = std::min(cell, 4.0);
  }
  return best;
}

Approximation approximate(SolidSurface& surface, double max_error) {
  const std::size_t triangles = surface.arrays().triangle_count;
  if (triangles > kFieldTriangles && max_error == 0) {
    Approximation few = clustered(surface, cell_for(surface.arrays(), kFieldTriangles));
    if (!few.mesh.triangles.empty()) return few;
  }
  if (triangles > kFieldTriangles && max_error > 0)
    if (std::optional<Approximation> few = clustered_within(surface, max_error))
      if (few->mesh.triangles.size() < triangles) return std::move(*few);
  Approximation own = own_triangles(surface.arrays());
  if (max_error > 0 && !(own.error <= max_error))
    throw Error("the field's error asked for is finer than floats can be; ask for at least " +
                std::to_string(own.error / max_error) + " times as much");
  return own;
}

}  // namespace

std::optional<FieldArrays> build_field(const MeshSolid& solid, double max_error) {
  std::optional<SolidSurface> surface = SolidSurface::of(solid);
  // A mesh that meets itself: here its solid will be given a surface of its own, polygonise().
  if (!surface) return std::nullopt;
  const Approximation near = approximate(*surface, max_error);
  if (near.mesh.triangles.empty()) return std::nullopt;
  FieldArrays arrays;
  arrays.header.error = near.error;
  arrays.header.triangle_count = static_cast<std::uint32_t>(near.mesh.triangles.size());
  cut_into_blocks(near.mesh, arrays);
  const FieldHierarchy hierarchy(near.mesh);
  lay_sign_grid(hierarchy.view(), arrays);
  return arrays;
}

}  // namespace ist
