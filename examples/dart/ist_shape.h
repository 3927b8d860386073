#pragma once

#include <ist/query.h>
#include <dart/dynamics/Inertia.hpp>
#include <dart/dynamics/Shape.hpp>
#include <dart/dynamics/ShapeFrame.hpp>

#include <string>
#include <variant>

namespace ist_dart {

/// A baked asset as a DART shape. Collides under IstCollisionDetector alone; to show the solid give
/// the body a MeshShape with a VisualAspect beside it.
class IstShape final : public dart::dynamics::Shape {
 public:
  /// `tree`: copied as a view; its bytes must outlive the shape.
  /// `scale`: [m/u] > 0, 0.001 for a mesh in millimetres.
  explicit IstShape(const ist::TreeView& tree, double scale = 1);

  const std::string& getType() const override { return getStaticType(); }
  static const std::string& getStaticType();

  const ist::TreeView& tree() const { return tree_; }
  double scale() const { return scale_; }

  /// [kg m²] about the centre of mass, which need not be the shape's origin.
  Eigen::Matrix3d computeInertia(double mass) const override;

  /// Mass, centre of mass and moments of the solid at a density [kg/m³], in the shape's frame:
  /// BodyNode::setInertia() takes it where the shape's frame is the body's.
  dart::dynamics::Inertia inertia(double density) const;

 protected:
  void updateVolume() const override;
  void updateBoundingBox() const override;

 private:
  ist::TreeView tree_;
  double scale_;
};

/// What stands for a shape in queries; monostate if nothing does.
using PlacedSolid = std::variant<std::monostate, ist::PlacedTree, ist::PlacedField>;

/// The shape of a frame at the frame's place: of an IstShape the tree, of a PlaneShape (solid below
/// its plane), BoxShape, SphereShape, CapsuleShape and CylinderShape the field.
PlacedSolid placed_solid(const dart::dynamics::ShapeFrame& frame);

}  // namespace ist_dart
