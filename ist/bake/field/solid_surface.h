#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "mesh/bvh.h"
#include "mesh/mesh_solid.h"
#include "mesh/mesh_view.h"

namespace ist {

/// The boundary of a mesh's solid: closed, with winding number 1 inside and 0 outside. It refers to
/// the solid's vertices.
class SolidSurface {
 public:
  /// Nothing for a mesh that meets itself, or may: its boundary is not made of whole triangles.
  static std::optional<SolidSurface> of(const MeshSolid& solid);

  SolidSurface(SolidSurface&&) = default;
  SolidSurface& operator=(SolidSurface&&) = default;

  /// Vertices (all of the mesh's) and the triangles of the boundary, in the mesh's order.
  const MeshView& arrays() const { return arrays_; }
  /// The same with a hierarchy, made when it is first asked for. Not for several threads at once.
  const MeshView& view();

 private:
  explicit SolidSurface(const MeshSolid& solid) : solid_(&solid), arrays_(solid.arrays()) {}

  const MeshSolid* solid_;
  std::vector<std::uint32_t> kept_;  ///< corners of the triangles, where not all are kept
  MeshView arrays_;
  std::optional<Bvh> hierarchy_;  ///< of the kept triangles
  MeshView view_;
};

}  // namespace ist
