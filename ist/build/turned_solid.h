#pragma once

#include <memory>

#include "mesh/mesh_solid.h"

namespace ist {

/// Area of a mesh's shadow along each axis, unit frame², a point counted as often as a line along
/// the axis enters the surface there.
Eigen::Vector3d shadow_areas(const MeshView& mesh);

/// A solid seen so that lines along x meet it well. A thin plate is measured exactly by the lines
/// that pierce it and badly by those that run along it; so where the shadow along x is small, the
/// axes are turned until x is the axis of the largest.
class TurnedSolid {
 public:
  explicit TurnedSolid(const MeshSolid& solid);

  const MeshSolid& solid() const { return turned_ ? *turned_ : original_; }
  /// From the unit frame of the original to that of solid(), and back.
  Eigen::Vector3d turn(const Eigen::Vector3d& x) const;
  Eigen::Vector3d turn_back(const Eigen::Vector3d& x) const;

 private:
  const MeshSolid& original_;
  std::unique_ptr<MeshSolid> turned_;  // null: the original's axes serve
  int axis_ = 0;                       // of the original that lies along x
};

}  // namespace ist
