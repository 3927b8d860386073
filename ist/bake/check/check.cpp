#include <ist/bake.h>
#include <ist/error.h>

#include <cmath>

#include <ist/asset_layout.h>
#include "bake/check/check_field.h"
#include "bake/check/check_kept_mesh.h"
#include "bake/check/check_mass.h"
#include "bake/check/check_spheres.h"
#include "bake/check/check_surface.h"
#include "bake/check/check_tree.h"
#include "bake/check/distance_solid.h"
#include "mesh/mesh_solid.h"
#include "mesh/polygonise.h"
#include "mesh/resolve/resolve.h"
#include "stage/thread_arena.h"

namespace ist {
namespace {

void append(std::vector<Invariant>& all, std::vector<Invariant> more) {
  for (Invariant& one : more) all.push_back(std::move(one));
}

Bounding bounding_of(const ClosedMesh& mesh) {
  if (mesh.report.meets_itself) return Bounding::parts;
  return mesh.report.shells != 1 ? Bounding::shells : Bounding::all;
}

/// `mesh`: what was baked, or made in the solid's place. `solid`: what spheres and covers are
/// certified against; `surface`: what matched spheres are calibrated by; of a mesh's asset they are
/// the same.
std::vector<Invariant> check_all(const AssetHeader& asset, const ClosedMesh& mesh,
                                 const CheckedSolid& solid, const CheckSurface& surface,
                                 const UnitFrame& frame, const MeshMoments& moments) {
  std::vector<Invariant> all;
  all.push_back(check_frame(asset, frame));
  append(all, check_mass(asset, moments, solid));
  append(all, check_bounds(asset, surface));
  append(all, check_kept_mesh(asset, mesh, frame, surface, bounding_of(mesh)));
  if (asset.sphere_count == 0) return all;
  append(all, check_spheres(asset, solid));
  all.push_back(check_cover(asset, solid));
  append(all, check_tree(asset, asset.inner_tree, at<Sphere>(asset, asset.inner_spheres),
                         at<float>(asset, asset.cover_radii), "inner tree"));
  for (std::uint32_t i = 0; i <= asset.detail_count; ++i) {
    const std::string name = i == 0 ? "" : "detail " + std::to_string(i) + ": ";
    append(all, check_matched(asset, i, surface, name));
    append(all, check_tree(asset, matched_tree(asset, i), matched_spheres(asset, i), nullptr,
                           name + "matched tree"));
  }
  append(all, check_field(asset, surface, bounding_of(mesh)));
  return all;
}

std::vector<Invariant> check_mesh(const AssetHeader& asset, const ClosedMesh& as_it_came) {
  const ClosedMesh mesh = resolve(as_it_came).mesh;
  const MeshSolid solid(mesh);
  if (solid.hash() != asset.mesh_hash || (asset.flags & kFlagPolygonised) != 0)
    throw Error(mesh.name + ": the asset was baked from another mesh; bake again");
  const CheckSurface surface(mesh, solid.frame());
  return check_all(asset, mesh, surface, surface, solid.frame(), solid.unit_moments());
}

std::vector<Invariant> check_solid(const AssetHeader& asset, const Solid& solid) {
  if ((asset.flags & kFlagPolygonised) == 0)
    throw Error("solid: the asset was baked from a mesh; check it against that mesh");
  const Polygonised made = polygonise(solid, asset.polygonise_cells);
  const ClosedMesh closed = close_mesh(made.mesh, "solid");
  const MeshSolid mesh(closed);
  const double scale = mesh.frame().scale();
  if (mesh.hash() != asset.mesh_hash || made.error / scale != asset.polygonise_error)
    throw Error("solid: the asset was baked from another solid; bake again");
  const double off = std::abs(mesh.volume() - solid.volume()) + solid.volume_error();
  MeshMoments moments = moments_near(mesh.arrays(), mesh.unit_moments(), made.error / scale);
  moments.volume_error += off / scale / scale / scale;
  return check_all(asset, closed, DistanceSolid(solid, mesh.frame()),
                   CheckSurface(closed, mesh.frame()), mesh.frame(), moments);
}

}  // namespace

std::vector<Invariant> check(const Asset& asset, const ClosedMesh& mesh, unsigned threads) {
  tbb::task_arena arena = thread_arena(threads);
  return arena.execute([&] { return check_mesh(asset.view().header(), mesh); });
}

std::vector<Invariant> check(const Asset& asset, const Solid& solid, unsigned threads) {
  if (solid.mesh() != nullptr)
    throw Error("solid: this solid is a mesh; check the asset against its ClosedMesh");
  tbb::task_arena arena = thread_arena(threads);
  return arena.execute([&] { return check_solid(asset.view().header(), solid); });
}

}  // namespace ist
