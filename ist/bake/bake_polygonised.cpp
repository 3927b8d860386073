#include <algorithm>
#include <cmath>
#include <numbers>

#include <ist/error.h>

#include "bake/backend/make_backend.h"
#include "bake/backend/polygonised_backend.h"
#include "bake/bake_solid.h"
#include "bake/mass_and_bounds.h"
#include "mesh/lipschitz.h"
#include "mesh/polygonise.h"
#include "numerics/roots.h"
#include "packing/base/packing_settings.h"
#include "stage/thread_arena.h"

namespace ist {
namespace {

// Edge of a cell over the mean sphere radius: the error is then some 5 % of that radius.
constexpr double kCellOverRadius = 0.4;
constexpr unsigned kFewestByDefault = 32, kMostByDefault = 256;

/// Cells along the longest side that suit as many spheres.
unsigned cells_for(const Solid& solid, std::size_t spheres) {
  const double count = spheres == 0 ? 1e4 : static_cast<double>(spheres);
  const double radius = cube_root(3 * solid.volume() / (4 * std::numbers::pi * count));
  const double cells = solid.bounds().sizes().maxCoeff() / (kCellOverRadius * radius);
  if (!(cells < kMostByDefault)) return kMostByDefault;
  return std::max(kFewestByDefault, static_cast<unsigned>(std::ceil(cells)));
}

Asset bake_mesh_of(const MeshSolid& solid, const PackingSettings& settings, const std::string& name,
                   const ProgressCallback& progress) {
  ClosedMesh described;  // the solid holds its geometry
  described.name = name;
  const auto backend = make_backend(solid, {settings.device, settings.gpu});
  const Resolution as_it_is;  // make_solid() has resolved it
  SolidField field(solid, as_it_is, settings.surface, settings.threads);
  return bake_solid(described, solid, field, *backend, settings, progress);
}

Asset bake_field(const Solid& solid, const PackingSettings& settings,
                 const PolygoniseSettings& meshing, const ProgressCallback& progress) {
  if (settings.grid != GridMode::banded)
    throw Error(meshing.name +
                ": only the banded mode packs solids that are not meshes; set grid to banded");
  require_lipschitz(solid);
  const unsigned cells =
      meshing.cells != 0 ? meshing.cells : cells_for(solid, settings.max_spheres);
  Polygonised made = polygonise(solid, cells, progress);
  const ClosedMesh mesh = close_mesh(std::move(made.mesh), meshing.name);
  const MeshSolid mesh_solid(mesh);
  const auto backend = make_polygonised_backend(solid, mesh_solid, made.error);
  Resolution as_made;  // the mesh is near the solid as it is
  if (mesh.report.meets_itself) as_made.how = Resolution::How::unresolved;
  SolidField field(mesh_solid, as_made, settings.surface, settings.threads);
  AssetArrays arrays = bake_arrays(mesh, mesh_solid, field, *backend, settings, progress);
  const double scale = mesh_solid.frame().scale();
  // Field and mesh are the mesh's, and that is near the solid.
  if (arrays.field != nullptr) {
    FieldArrays of_solid = *arrays.field;
    of_solid.header.error += made.error / scale;
    arrays.field = std::make_shared<const FieldArrays>(std::move(of_solid));
  }
  if (arrays.mesh != nullptr) {
    MeshArrays of_solid = *arrays.mesh;
    of_solid.header.error += made.error / scale;
    arrays.mesh = std::make_shared<const MeshArrays>(std::move(of_solid));
    arrays.header.mesh_state = static_cast<std::uint32_t>(MeshState::simplified);
  }
  const double off = std::abs(mesh_solid.volume() - solid.volume()) + solid.volume_error();
  arrays.header.flags |= kFlagPolygonised;
  MeshMoments moments =
      moments_near(mesh_solid.arrays(), mesh_solid.unit_moments(), made.error / scale);
  moments.volume_error += off / scale / scale / scale;
  describe_mass(moments, arrays.header);
  describe_bounds(mesh_solid, made.error / scale, arrays.header);
  arrays.header.polygonise_error = made.error / scale;
  arrays.header.polygonise_cells = cells;
  return Asset(asset_bytes(arrays), meshing.name);
}

}  // namespace

Asset bake(const Solid& solid, const PackingSettings& settings, const ProgressCallback& progress,
           const PolygoniseSettings& meshing) {
  packing::check_settings(settings);
  return thread_arena(settings.threads).execute([&] {
    return solid.mesh() != nullptr ? bake_mesh_of(*solid.mesh(), settings, meshing.name, progress)
                                   : bake_field(solid, settings, meshing, progress);
  });
}

}  // namespace ist
