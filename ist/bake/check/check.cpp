#include <ist/bake.h>
#include <ist/error.h>

#include <ist/asset_layout.h>
#include "bake/check/check_field.h"
#include "bake/check/check_spheres.h"
#include "bake/check/check_surface.h"
#include "bake/check/check_tree.h"
#include "mesh/mesh_solid.h"
#include "stage/thread_arena.h"

namespace ist {
namespace {

void append(std::vector<Invariant>& all, std::vector<Invariant> more) {
  for (Invariant& one : more) all.push_back(std::move(one));
}

std::vector<Invariant> check_all(const AssetHeader& asset, const ClosedMesh& mesh) {
  const MeshSolid solid(mesh);
  if (solid.hash() != asset.mesh_hash)
    throw Error(mesh.name + ": the asset was baked from another mesh; bake again");
  const CheckSurface surface(mesh, solid.frame());
  std::vector<Invariant> all = check_header(asset, surface, solid);
  append(all, check_spheres(asset, surface));
  all.push_back(check_cover(asset, surface));
  append(all, check_tree(asset, asset.inner_tree, at<Sphere>(asset, asset.inner_spheres),
                         at<float>(asset, asset.cover_radii), "inner tree"));
  for (std::uint32_t i = 0; i <= asset.detail_count; ++i) {
    const std::string name = i == 0 ? "" : "detail " + std::to_string(i) + ": ";
    append(all, check_matched(asset, i, surface, name));
    append(all, check_tree(asset, matched_tree(asset, i), matched_spheres(asset, i), nullptr,
                           name + "matched tree"));
  }
  append(all, check_field(asset, surface, mesh.report.shells != 1));
  return all;
}

}  // namespace

std::vector<Invariant> check(const Asset& asset, const ClosedMesh& mesh, unsigned threads) {
  tbb::task_arena arena = thread_arena(threads);
  return arena.execute([&] { return check_all(asset.view().header(), mesh); });
}

}  // namespace ist
