#include "library/input_mesh.h"

#include <ist/types.h>
#include <utility>

namespace ist {

void place(TriangleMesh& mesh, const MeshSettings& settings) {
  scale_mesh(mesh, settings.scale);
  if (settings.up_axis == 0 || settings.up_axis == settings.world_up) return;
  // Coordinates are permuted and negated: no digit is lost.
  const int from = settings.up_axis - 'X', to = settings.world_up - 'X';
  for (Eigen::Vector3d& v : mesh.vertices) {
    const double up = v[from];
    v[from] = -v[to];
    v[to] = up;
  }
}

ClosedMesh close_as_asked(TriangleMesh mesh, const std::string& name,
                          const MeshSettings& settings) {
  const OpenMeshPolicy policy = settings.repair ? OpenMeshPolicy::repair : OpenMeshPolicy::refuse;
  if (settings.wrap == 0) return close_mesh(std::move(mesh), name, policy);
  std::string why;
  try {
    return close_mesh(mesh, name, policy);
  } catch (const Error& error) {
    why = error.what();
  }
  ClosedMesh wrapped = wrap_mesh(std::move(mesh), name, settings.wrap);
  if (why.starts_with(name + ": ")) why.erase(0, name.size() + 2);
  wrapped.report.notes.insert(wrapped.report.notes.begin(), "wrapped, because: " + why);
  return wrapped;
}

InputMesh read_input_mesh(const std::string& path, const MeshSettings& settings) {
  TriangleMesh mesh = load_mesh(path);
  place(mesh, settings);
  InputMesh result{mesh.declared, {}};
  result.closed = close_as_asked(std::move(mesh), path, settings);
  return result;
}

Baked bake_as_asked(const ClosedMesh& mesh, const BakeSettings& asked,
                    const ProgressCallback& progress) {
  const PackingSettings& settings = asked.packing;
  if (asked.mesh_only) return {bake_mesh_only(mesh, settings.threads, progress)};
  if (!(asked.target.relative_error > 0)) return {bake(mesh, settings, progress)};
  TargetedAsset found = bake_to_error(mesh, asked.target, settings, progress);
  Baked baked = {std::move(found.asset)};
  for (const PartnerError& partner : found.partners)
    if (partner.poses > 0) baked.partners.push_back(partner);
  return baked;
}

}  // namespace ist
