#include "ist_shape.h"

#include <ist/mass_properties.h>
#include <ist/pose_eigen.h>
#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/CapsuleShape.hpp>
#include <dart/dynamics/CylinderShape.hpp>
#include <dart/dynamics/PlaneShape.hpp>
#include <dart/dynamics/SphereShape.hpp>

#include <cmath>

namespace ist_dart {

namespace dynamics = dart::dynamics;

IstShape::IstShape(const ist::TreeView& tree, double scale) : tree_(tree), scale_(scale) {}

const std::string& IstShape::getStaticType() {
  static const std::string type("IstShape");
  return type;
}

Eigen::Matrix3d IstShape::computeInertia(double mass) const {
  const ist::MassProperties solid = ist::mass_properties(tree_);
  return solid.inertia * (mass / solid.volume * scale_ * scale_);
}

dynamics::Inertia IstShape::inertia(double density) const {
  const ist::MassProperties solid = ist::mass_properties(tree_);
  const double mass = density * solid.volume * std::pow(scale_, 3);
  return dynamics::Inertia(mass, solid.centre_of_mass * scale_, computeInertia(mass));
}

void IstShape::updateVolume() const {
  mVolume = ist::mass_properties(tree_).volume * std::pow(scale_, 3);
  mIsVolumeDirty = false;
}

void IstShape::updateBoundingBox() const {
  const ist::Bounds bounds = ist::bounds(tree_);
  mBoundingBox.setMin(bounds.lower * scale_);
  mBoundingBox.setMax(bounds.upper * scale_);
  mIsBoundingBoxDirty = false;
}

PlacedSolid placed_solid(const dynamics::ShapeFrame& frame) {
  const dynamics::ConstShapePtr shape = frame.getShape();
  if (!shape) return {};
  const ist::Pose pose = ist::to_pose(frame.getWorldTransform());
  const auto field = [&](const ist::Field& one) { return ist::PlacedField{one, pose}; };

  // Shapes are told by their type, as DART's own detectors do.
  if (const auto* baked = dynamic_cast<const IstShape*>(shape.get()))
    return ist::PlacedTree{baked->tree(), pose, baked->scale()};
  if (const auto* plane = dynamic_cast<const dynamics::PlaneShape*>(shape.get()))
    return field(ist::HalfSpaceField{plane->getNormal(), plane->getOffset()});
  if (const auto* box = dynamic_cast<const dynamics::BoxShape*>(shape.get()))
    return field(ist::BoxField{box->getSize() / 2});
  if (const auto* ball = dynamic_cast<const dynamics::SphereShape*>(shape.get()))
    return field(ist::BallField{ball->getRadius()});
  if (const auto* capsule = dynamic_cast<const dynamics::CapsuleShape*>(shape.get()))
    return field(ist::CapsuleField{capsule->getRadius(), capsule->getHeight() / 2});
  if (const auto* cylinder = dynamic_cast<const dynamics::CylinderShape*>(shape.get()))
    return field(ist::CylinderField{cylinder->getRadius(), cylinder->getHeight() / 2});
  return {};
}

}  // namespace ist_dart
