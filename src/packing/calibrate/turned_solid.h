#pragma once

#include <memory>

#include "mesh/mesh_solid.h"

namespace ist {

/// A solid seen so that lines along x meet it well. A thin plate is measured exactly by the lines
/// that pierce it and badly by those that run along it, a needle by none if it lies at a slant in
/// its box. So where few lines of the box along x meet the solid, it is turned: x is then the
/// principal axis along which its surface extends least, z the one along which it extends most.
class TurnedSolid {
 public:
  explicit TurnedSolid(const MeshSolid& solid);

  const MeshSolid& solid() const { return turned_ ? *turned_ : original_; }
  /// Length of solid()'s unit in the original's unit frame.
  double scale() const { return turned_ ? turned_->frame().scale() : 1; }
  /// From the unit frame of the original to that of solid(), and back.
  Eigen::Vector3d turn(const Eigen::Vector3d& x) const;
  Eigen::Vector3d turn_back(const Eigen::Vector3d& x) const;

 private:
  const MeshSolid& original_;
  std::unique_ptr<MeshSolid> turned_;                   // null: the original serves
  Eigen::Matrix3d axes_ = Eigen::Matrix3d::Identity();  // rows
};

}  // namespace ist
