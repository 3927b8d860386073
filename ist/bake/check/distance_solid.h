#pragma once

#include <ist/solid.h>

#include "bake/check/checked_solid.h"

namespace ist {

/// A solid known by its signed distance, as `check` sees it. Refers to the solid.
class DistanceSolid final : public CheckedSolid {
 public:
  DistanceSolid(const Solid& solid, const UnitFrame& frame);

  double distance(const Eigen::Vector3d& p, double limit) const override;
  int winding(const Eigen::Vector3d& p) const override;
  const Eigen::AlignedBox3d& bounds() const override { return bounds_; }

 private:
  double value(const Eigen::Vector3d& p) const;

  const Solid& solid_;
  UnitFrame frame_;
  Eigen::AlignedBox3d bounds_;
};

}  // namespace ist
