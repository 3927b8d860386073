#include "bake/mesh/float_mesh.h"

#include <algorithm>

namespace ist {

FloatMesh in_floats(const MeshView& mesh) {
  FloatMesh out;
  out.vertices.resize(mesh.vertex_count);
  out.triangles.resize(mesh.triangle_count);
  for (std::size_t v = 0; v < out.vertices.size(); ++v)
    for (std::size_t k = 0; k < 3; ++k)
      out.vertices[v][k] = static_cast<float>(mesh.vertices[3 * v + k]);
  for (std::size_t t = 0; t < out.triangles.size(); ++t)
    std::copy_n(mesh.triangles + 3 * t, 3, out.triangles[t].begin());
  return out;
}

}  // namespace ist
