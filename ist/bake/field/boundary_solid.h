#pragma once

#include <ist/solid.h>
#include <vector>

#include "bake/field/overlaps.h"
#include "mesh/bvh.h"
#include "mesh/mesh_solid.h"
#include "mesh/mesh_view.h"

namespace ist {

/// The solid of a mesh that meets itself, by the distance from its boundary alone: walls within it
/// do not count, but for what of them is within a piece's length of other triangles. All in the
/// unit frame.
class BoundarySolid final : public Solid {
 public:
  /// Both must outlive this. `piece`: triangles that meet others are divided down to it, > 0.
  BoundarySolid(const MeshSolid& solid, const Overlaps& overlaps, double piece);

  double signed_distance(const Eigen::Vector3d& x) const override;
  Eigen::AlignedBox3d bounds() const override;
  double volume() const override { return solid_.unit_volume(); }

 private:
  const MeshSolid& solid_;
  std::vector<double> vertices_;
  std::vector<std::uint32_t> corners_;
  Bvh bvh_;
  MeshView view_;
};

}  // namespace ist
