#include "ist_shape.h"

#include <LinearMath/btAabbUtil2.h>

#include "to_bullet.h"

IstShape::IstShape(const ist::TreeView& tree, const Eigen::AlignedBox3d& bounds,
                   const btTransform& mesh_in_body, const btVector3& unit_inertia)
    : tree_(tree), mesh_in_body_(mesh_in_body), unit_inertia_(unit_inertia) {
  m_shapeType = kType;
  btTransformAabb(to_bullet(Eigen::Vector3d(bounds.min())),
                  to_bullet(Eigen::Vector3d(bounds.max())), 0, mesh_in_body, lower_, upper_);
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
