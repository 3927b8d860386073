#include "library/input_mesh.h"

#include <utility>

namespace ist {

void place(TriangleMesh& mesh, const MeshSettings& settings) {
  if (settings.scale != 1)
    for (Eigen::Vector3d& v : mesh.vertices) v *= settings.scale;
  if (settings.up_axis == 0 || settings.up_axis == settings.world_up) return;
  // Coordinates change places and signs: no digit is lost.
  const int from = settings.up_axis - 'X', to = settings.world_up - 'X';
  for (Eigen::Vector3d& v : mesh.vertices) {
    const double up = v[from];
    v[from] = -v[to];
    v[to] = up;
  }
}

InputMesh read_input_mesh(const std::string& path, const MeshSettings& settings) {
  TriangleMesh mesh = load_mesh(path);
  place(mesh, settings);
  InputMesh result{mesh.declared, {}};
  result.closed = close_mesh(std::move(mesh), path,
                             settings.repair ? OpenMeshPolicy::repair : OpenMeshPolicy::refuse);
  return result;
}

}  // namespace ist
