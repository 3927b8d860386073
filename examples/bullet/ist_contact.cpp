#include "ist_contact.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <cmath>
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

IstPair pair_of(const btCollisionObject& first, const btCollisionObject& second) {
  if (as_ist(second) != nullptr) return {&first, &second, {}};
  if (as_ist(first) != nullptr) return {&second, &first, {}};
  return {};
}

double largest_motion(const IstPair& pair, const btTransform& before, const btTransform& now) {
  // A turn by θ moves what is R away by 2 R sin(θ/2), and two bases differ by √8 sin(θ/2).
  double turned = 0;
  for (int i = 0; i < 3; ++i) turned += (now.getBasis()[i] - before.getBasis()[i]).length2();
  return (now.getOrigin() - before.getOrigin()).length() +
         as_ist(*pair.b)->reach() * std::sqrt(0.5 * turned);
}

bool find_contact(const btCollisionObject& first, const btCollisionObject& second,
                  std::size_t patches, const ist::ContactSettings& settings,
                  ist::Workspace& workspace, IstContact& contact) {
  contact.pair = pair_of(first, second);
  if (contact.pair.b == nullptr) return false;
  const IstShape& b = *as_ist(*contact.pair.b);
  contact.pair.tree_b = placed(*contact.pair.b, b);
  const std::span<ist::ContactPatch> room(contact.patches.data(), patches);
  const auto keep = [&](const ist::ContactPatches& found) {
    contact.whole = found.penetration;
    contact.count = found.count;
    return true;
  };
  contact.clearance = 0;
  if (const IstShape* const a = as_ist(*contact.pair.a)) {
    const ist::PlacedTree tree_a = placed(*contact.pair.a, *a);
    keep(ist::contact_patches(tree_a, contact.pair.tree_b, settings, workspace, room));
    if (contact.whole.volume_max <= 0) {
      // A bound tells enough: the first few nodes give one.
      constexpr ist::SeparationSettings kGlance{.max_visits = 8, .inner_spheres = true};
      const ist::Separation gap = ist::separation(tree_a, contact.pair.tree_b, kGlance, workspace);
      contact.clearance = gap.distance_min - a->tree().protrusion() - b.tree().protrusion();
    }
    return true;
  }
  const auto field =
      as_field(*contact.pair.a->getCollisionShape(), contact.pair.a->getWorldTransform());
  if (!field) return false;
  return keep(ist::contact_patches(*field, contact.pair.tree_b, settings, workspace, room));
}
