#pragma once

#include <memory>
#include <optional>

#include <ist/mesh.h>

#include "mesh/mesh_solid.h"
#include "mesh/soup_winding.h"

namespace ist {

/// Any triangles, to be asked for closest points; inside() and volume() mean nothing.
std::unique_ptr<MeshSolid> triangles_as_solid(TriangleMesh mesh);

/// The generalised winding number of any triangles, however they face: coincident ones are reduced
/// to their signed sum, then patches are turned outward (orient_soup). Ask it from any thread.
class [[gnu::visibility("hidden")]] OutwardWinding {
 public:
  explicit OutwardWinding(TriangleMesh mesh);

  /// `x`: [u]. 0 where all triangles cancel.
  double at(const Eigen::Vector3d& x) const;

 private:
  std::unique_ptr<MeshSolid> surface_;
  std::optional<SoupWinding> winding_;
};

}  // namespace ist
