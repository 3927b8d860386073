#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace ist {

/// A solid as `check` asks it, unit frame. Immutable.
class CheckedSolid {
 public:
  virtual ~CheckedSolid() = default;

  /// Distance to the surface, or less where that is not known exactly; once nothing is nearer than
  /// `limit`, any value ≥ limit.
  virtual double distance(const Eigen::Vector3d& p, double limit) const = 0;

  /// Winding number of a point off the surface: ≥ 1 inside.
  virtual int winding(const Eigen::Vector3d& p) const = 0;

  virtual const Eigen::AlignedBox3d& bounds() const = 0;  ///< holds the whole solid
};

}  // namespace ist
