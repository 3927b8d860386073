#include "ist_shape.h"

#include <LinearMath/btAabbUtil2.h>
#include <ist/mass_properties.h>

#include <Eigen/Eigenvalues>

#include "to_bullet.h"

IstBodyFrame body_frame(const ist::TreeView& tree) {
  const ist::MassProperties mass = ist::mass_properties(tree);
  IstBodyFrame frame{Eigen::Isometry3d::Identity(), mass.inertia.diagonal() / mass.volume};
  const Eigen::Matrix3d diagonal = mass.inertia.diagonal().asDiagonal();
  if ((mass.inertia - diagonal).norm() > 1e-6 * mass.inertia.norm()) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(mass.inertia);
    Eigen::Matrix3d axes = solver.eigenvectors();
    if (axes.determinant() < 0) axes.col(2) *= -1;
    frame.in_mesh.linear() = axes;
    frame.unit_inertia = solver.eigenvalues() / mass.volume;
  }
  frame.in_mesh.translation() = mass.centre_of_mass;
  return frame;
}

IstShape::IstShape(const ist::TreeView& tree) : tree_(tree) {
  m_shapeType = kType;
  const IstBodyFrame frame = body_frame(tree);
  mesh_in_body_ = to_bullet(Eigen::Isometry3d(frame.in_mesh.inverse()));
  unit_inertia_ = to_bullet(frame.unit_inertia);
  // Matched spheres stick out of the solid by this: what they meet there is a contact.
  const ist::Bounds bounds = ist::bounds(tree);
  btTransformAabb(to_bullet(bounds.lower), to_bullet(bounds.upper), tree.protrusion(),
                  mesh_in_body_, lower_, upper_);
  reach_ = (mesh_in_body_ * to_bullet(bounds.centre)).length() + bounds.radius + tree.protrusion();
}

void IstShape::getAabb(const btTransform& t, btVector3& lower, btVector3& upper) const {
  btTransformAabb(lower_, upper_, 0, t, lower, upper);
}

void IstShape::calculateLocalInertia(btScalar mass, btVector3& inertia) const {
  inertia = mass * unit_inertia_;
}

void IstShape::setLocalScaling([[maybe_unused]] const btVector3& scaling) {
  btAssert(scaling == one_);
}

IstTerrain::IstTerrain(const ist::HeightField& field)
    : btHeightfieldTerrainShape(static_cast<int>(field.columns), static_cast<int>(field.rows),
                                field.heights, field.lowest, field.highest, 2, true),
      field_(field) {
  btHeightfieldTerrainShape::setLocalScaling({field.spacing[0], field.spacing[1], 1});
}

btVector3 IstTerrain::field_origin() const {
  return {-0.5 * field_.spacing[0] * (field_.columns - 1),
          -0.5 * field_.spacing[1] * (field_.rows - 1), -0.5 * (field_.lowest + field_.highest)};
}
