#include "bake/check/distance_solid.h"

#include <cmath>

namespace ist {

DistanceSolid::DistanceSolid(const Solid& solid, const UnitFrame& frame)
    : solid_(solid),
      frame_(frame),
      bounds_(frame.to_unit(solid.bounds().min()), frame.to_unit(solid.bounds().max())) {}

double DistanceSolid::distance(const Eigen::Vector3d& p, double) const {
  return std::abs(value(p));
}

int DistanceSolid::winding(const Eigen::Vector3d& p) const { return value(p) > 0 ? 1 : 0; }

double DistanceSolid::value(const Eigen::Vector3d& p) const {
  return solid_.signed_distance(frame_.from_unit(p)) / frame_.scale();
}

}  // namespace ist
