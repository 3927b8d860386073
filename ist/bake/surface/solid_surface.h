#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "mesh/bvh.h"
#include "mesh/mesh_solid.h"
#include "mesh/mesh_view.h"

namespace ist {

/// A closed surface that tells a mesh's solid: inside the winding number about it is odd, outside
/// it is even, but for points that a triangle of it is near to.
class SolidSurface {
 public:
  /// The boundary of the solid where that is made of whole triangles. Triangles that meet others,
  /// and inner walls about them, stay where they reach at most `enough` (unit frame). Nothing where
  /// they reach further, or that is not known. It refers to the solid.
  static std::optional<SolidSurface> of(const MeshSolid& solid, double enough);

  SolidSurface(SolidSurface&&) = default;
  SolidSurface& operator=(SolidSurface&&) = default;

  /// Vertices and triangles.
  const MeshView& arrays() const { return arrays_; }
  /// The same with a hierarchy, made when it is first asked for. Not for several threads at once.
  const MeshView& view();

  /// Unit frame, proven: this surface and the solid's lie within it of each other, and where the
  /// winding number here and the solid differ, a triangle is as near.
  double off() const { return off_; }

 private:
  explicit SolidSurface(const MeshSolid& solid) : solid_(&solid), arrays_(solid.arrays()) {}

  static std::optional<SolidSurface> of_shells(const MeshSolid& solid);

  const MeshSolid* solid_;                ///< its hierarchy serves where all its triangles are kept
  std::vector<std::uint32_t> triangles_;  ///< corners, where they are not all of the solid's
  MeshView arrays_;
  double off_ = 0;
  std::optional<Bvh> hierarchy_;
  MeshView view_;
};

}  // namespace ist
