#include "ist_contact.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <optional>

#include "ist_shape.h"
#include "to_bullet.h"

namespace {

const IstShape* as_ist(const btCollisionObject& object) {
  const btCollisionShape* const shape = object.getCollisionShape();
  return shape->getShapeType() == IstShape::kType ? static_cast<const IstShape*>(shape) : nullptr;
}

ist::PlacedTree placed(const btCollisionObject& object, const IstShape& shape) {
  return {shape.tree(), to_pose(object.getWorldTransform() * shape.mesh_in_body())};
}

std::optional<ist::PlacedField> as_field(const btCollisionShape& shape, const btTransform& at) {
  switch (shape.getShapeType()) {
    case STATIC_PLANE_PROXYTYPE: {
      const auto& plane = static_cast<const btStaticPlaneShape&>(shape);
      return ist::PlacedField{
          ist::HalfSpaceField{to_eigen(plane.getPlaneNormal()), plane.getPlaneConstant()},
          to_pose(at)};
    }
    case BOX_SHAPE_PROXYTYPE:
      return ist::PlacedField{
          ist::BoxField{to_eigen(static_cast<const btBoxShape&>(shape).getHalfExtentsWithMargin())},
          to_pose(at)};
    case SPHERE_SHAPE_PROXYTYPE:
      return ist::PlacedField{ist::BallField{static_cast<const btSphereShape&>(shape).getRadius()},
                              to_pose(at)};
    case TERRAIN_SHAPE_PROXYTYPE:
      if (const auto* const terrain = dynamic_cast<const IstTerrain*>(&shape)) {
        return ist::PlacedField{
            terrain->field(),
            to_pose(at * btTransform(btQuaternion::getIdentity(), terrain->field_origin()))};
      }
      return std::nullopt;
    default:
      return std::nullopt;
  }
}

}  // namespace

bool is_known(const btCollisionShape& shape) {
  return shape.getShapeType() == IstShape::kType ||
         as_field(shape, btTransform::getIdentity()).has_value();
}

bool find_contact(const btCollisionObject& first, const btCollisionObject& second,
                  std::size_t patches, const ist::ContactSettings& settings,
                  ist::Workspace& workspace, IstContact& contact) {
  const bool swapped = as_ist(second) == nullptr;
  contact.pair.a = swapped ? &second : &first;
  contact.pair.b = swapped ? &first : &second;
  const IstShape* const b = as_ist(*contact.pair.b);
  if (b == nullptr) return false;
  contact.pair.tree_b = placed(*contact.pair.b, *b);
  const std::span<ist::ContactPatch> room(contact.patches.data(), patches);
  const auto keep = [&](const ist::ContactPatches& found) {
    contact.whole = found.penetration;
    contact.count = found.count;
    return true;
  };
  if (const IstShape* const a = as_ist(*contact.pair.a)) {
    return keep(ist::contact_patches(placed(*contact.pair.a, *a), contact.pair.tree_b, settings,
                                     workspace, room));
  }
  const auto field =
      as_field(*contact.pair.a->getCollisionShape(), contact.pair.a->getWorldTransform());
  if (!field) return false;
  return keep(ist::contact_patches(*field, contact.pair.tree_b, settings, workspace, room));
}
