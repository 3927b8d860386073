#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bake/surface/float_mesh.h"
#include "mesh/bvh.h"
#include "mesh/mesh_view.h"

namespace ist {

/// A surface as the mesh's exact predicates and distances take it.
class SurfaceHierarchy {
 public:
  explicit SurfaceHierarchy(const FloatMesh& mesh) {
    for (const FloatMesh::Vertex& v : mesh.vertices)
      vertices_.insert(vertices_.end(), v.begin(), v.end());
    for (const FloatMesh::Triangle& t : mesh.triangles)
      corners_.insert(corners_.end(), t.begin(), t.end());
    bvh_ = build_bvh(vertices_, corners_);
    view_ = {vertices_.data(),
             corners_.data(),
             static_cast<std::uint32_t>(mesh.vertices.size()),
             static_cast<std::uint32_t>(mesh.triangles.size()),
             bvh_.nodes.get(),
             bvh_.blocks.get(),
             bvh_.root};
  }
  SurfaceHierarchy(const SurfaceHierarchy&) = delete;
  SurfaceHierarchy& operator=(const SurfaceHierarchy&) = delete;

  const MeshView& view() const { return view_; }

 private:
  std::vector<double> vertices_;
  std::vector<std::uint32_t> corners_;
  Bvh bvh_;
  MeshView view_;
};

}  // namespace ist
