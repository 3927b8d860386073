#include "bullet/points.h"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <cmath>

#include <ist/bullet/convert.h>

namespace ist::bullet {

namespace {

constexpr std::size_t kPointsOfAManifold = MANIFOLD_CACHE_SIZE;

/// Stores a patch's name in the fields in which Bullet keeps the triangles of a point.
void set_name(btManifoldPoint& point, std::uint64_t id) {
  point.m_partId0 = static_cast<int>(id >> 32);
  point.m_index0 = static_cast<int>(id & 0xffffffffu);
}
bool same_name(const btManifoldPoint& a, const btManifoldPoint& b) {
  return a.m_partId0 == b.m_partId0 && a.m_index0 == b.m_index0;
}

/// The solver starts with the last step's impulses. The impulse that stopped an impact is not
/// needed again: the limit is twice the impulse of the point's spring in a step for bodies at rest.
void forget_impact(btManifoldPoint& point, double step) {
  const btScalar most = static_cast<btScalar>(2 * step) * point.m_combinedContactStiffness1 *
                        std::max(-point.m_distance1, btScalar(0));
  point.m_appliedImpulse = std::min(point.m_appliedImpulse, most);
}

void inherit(btManifoldPoint& point, const btManifoldPoint& from, double step) {
  point.m_appliedImpulse = from.m_appliedImpulse;
  forget_impact(point, step);
  point.m_prevRHS = from.m_prevRHS;
  point.m_appliedImpulseLateral1 = from.m_appliedImpulseLateral1;
  point.m_appliedImpulseLateral2 = from.m_appliedImpulseLateral2;
  point.m_lateralFrictionDir1 = from.m_lateralFrictionDir1;
  point.m_lateralFrictionDir2 = from.m_lateralFrictionDir2;
  point.m_contactMotion1 = from.m_contactMotion1;
}

btVector3 velocity_of(const btCollisionObject& object, const btVector3& point) {
  const btRigidBody* const body = btRigidBody::upcast(&object);
  if (body == nullptr) return {0, 0, 0};
  return body->getVelocityInLocalPoint(point - body->getCenterOfMassPosition());
}

btVector3 friction_of(const btManifoldPoint& point) {
  return point.m_appliedImpulseLateral1 * point.m_lateralFrictionDir1 +
         point.m_appliedImpulseLateral2 * point.m_lateralFrictionDir2;
}

/// Bullet's friction stops the point of contact at the beginning of a step. If a body rolls, that
/// point moves over it and has another speed when the next step begins. As a rod whirls on its rim,
/// friction acts along this change in every step and accelerates the rod. So friction acts here at
/// the point at which the body will touch. `before`: the friction of the step before the last one,
/// since that may alternate; this function replaces it.
void stop_next_place(btManifoldPoint& point, const btCollisionObject& first,
                     const btCollisionObject& second, btVector3& before) {
  const auto speed_known = [](const btCollisionObject& object) {
    return object.isStaticOrKinematicObject() || btRigidBody::upcast(&object) != nullptr;
  };
  const bool corner = point.m_partId0 < 0;  // of a SupportPolygon, which does not roll
  if (corner || !speed_known(first) || !speed_known(second)) {
    point.m_contactMotion1 = 0;
    before.setZero();
    return;
  }
  const btVector3& normal = point.m_normalWorldOnB;
  const btVector3 friction = friction_of(point), mean = before + friction;
  before = friction;
  btVector3 change = velocity_of(first, point.m_positionWorldOnA) -
                     velocity_of(second, point.m_positionWorldOnB) -
                     point.m_contactMotion1 * point.m_lateralFrictionDir1;
  change -= normal.dot(change) * normal;
  point.m_contactPointFlags &= ~BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED;
  point.m_contactMotion1 = 0;
  if (!(mean.dot(change) > 0)) return;
  const btScalar size = change.length();
  point.m_contactPointFlags |= BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED;
  point.m_lateralFrictionDir1 = change / size;
  point.m_lateralFrictionDir2 = point.m_lateralFrictionDir1.cross(normal);
  point.m_appliedImpulseLateral1 = friction.dot(point.m_lateralFrictionDir1);
  point.m_appliedImpulseLateral2 = friction.dot(point.m_lateralFrictionDir2);
  point.m_contactMotion1 = -size;
}

/// A point's material, combined from two bodies'; an engine may change these in any step.
struct Material {
  Material(const btCollisionObject& first, const btCollisionObject& second)
      : friction(gCalculateCombinedFrictionCallback(&first, &second)),
        rolling(gCalculateCombinedRollingFrictionCallback(&first, &second)),
        spinning(gCalculateCombinedSpinningFrictionCallback(&first, &second)),
        restitution(gCalculateCombinedRestitutionCallback(&first, &second)) {}

  void set(btManifoldPoint& point) const {
    point.m_combinedFriction = friction;
    point.m_combinedRollingFriction = rolling;
    point.m_combinedSpinningFriction = spinning;
    point.m_combinedRestitution = restitution;
  }

  btScalar friction, rolling, spinning, restitution;
};

void tell_owner(btManifoldPoint& point, const btCollisionObjectWrapper& a,
                const btCollisionObjectWrapper& b) {
  const int flags =
      a.getCollisionObject()->getCollisionFlags() | b.getCollisionObject()->getCollisionFlags();
  if (gContactAddedCallback == nullptr ||
      (flags & btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK) == 0)
    return;
  gContactAddedCallback(point, &a, point.m_partId0, point.m_index0, &b, point.m_partId1,
                        point.m_index1);
}

/// Points that are being replaced.
struct OldPoints {
  using Frictions = std::array<btVector3, Settings::kPatches>;

  OldPoints(const std::vector<btPersistentManifold*>& manifolds, const Frictions& of_points)
      : frictions(of_points) {
    for (btPersistentManifold* manifold : manifolds) {
      for (int i = 0; i < manifold->getNumContacts(); ++i)
        points[count++] = manifold->getContactPoint(i);
      // Bullet's own functions report an end whenever a manifold is empty, so they are not called.
      manifold->setNumContacts(0);
    }
  }

  void drop(std::size_t k) {
    points[k] = points[--count];
    frictions[k] = frictions[count];
  }

  /// Continues the point of the same patch in this one.
  bool give_to(btManifoldPoint& point, btVector3& friction, double step) {
    for (std::size_t k = 0; k < count; ++k) {
      if (!same_name(points[k], point)) continue;
      inherit(point, points[k], step);
      friction = frictions[k];
      point.m_userPersistentData = points[k].m_userPersistentData;
      point.m_lifeTime = points[k].m_lifeTime + 1;
      drop(k);
      return true;
    }
    return false;
  }

  /// A patch gets another name as it moves over the triangles: it takes over the impulse of the
  /// nearest old point whose name has disappeared.
  void give_impulse_to(btManifoldPoint& point, btVector3& friction, double step) {
    std::size_t nearest = count;
    btScalar least = BT_LARGE_FLOAT;
    for (std::size_t k = 0; k < count; ++k) {
      if (!(points[k].m_normalWorldOnB.dot(point.m_normalWorldOnB) > 0)) continue;
      const btScalar far = (points[k].m_positionWorldOnA - point.m_positionWorldOnA).length2();
      if (far < least) least = far, nearest = k;
    }
    if (nearest == count) return;
    inherit(point, points[nearest], step);
    friction = frictions[nearest];
    drop(nearest);
  }

  std::array<btManifoldPoint, Settings::kPatches> points;
  Frictions frictions;
  std::size_t count = 0;
};

}  // namespace

Eigen::Vector3d place_of(const ContactPatch& patch) {
  const Eigen::Vector3d aside = patch.point - patch.centroid;
  const double far = aside.norm(), width = std::sqrt(patch.area);
  return patch.centroid + (far > width ? width / far : 1) * aside;
}

std::size_t Points::count() const {
  std::size_t sum = 0;
  for (const btPersistentManifold* manifold : manifolds)
    sum += static_cast<std::size_t>(manifold->getNumContacts());
  return sum;
}

btPersistentManifold* Points::first_manifold(const btCollisionObject& first,
                                             const btCollisionObject& second,
                                             btDispatcher& dispatcher) {
  if (manifolds.empty()) manifolds.push_back(dispatcher.getNewManifold(&first, &second));
  return manifolds[0];
}

void Points::release(btDispatcher& dispatcher) {
  for (btPersistentManifold* manifold : manifolds) {
    // The end of a contact is reported once, with the first manifold.
    if (manifold != manifolds.front()) {
      for (int i = 0; i < manifold->getNumContacts(); ++i)
        manifold->clearUserCache(manifold->getContactPoint(i));
      manifold->setNumContacts(0);
    }
    dispatcher.releaseManifold(manifold);
  }
}

void Points::move(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
                  double step) {
  const btCollisionObject &first = *a.getCollisionObject(), &second = *b.getCollisionObject();
  const Material material(first, second);
  const btTransform& to_world_first = first.getWorldTransform();
  const btTransform& to_world_second = second.getWorldTransform();
  std::size_t at = 0;
  for (btPersistentManifold* manifold : manifolds) {
    for (int i = 0; i < manifold->getNumContacts(); ++i) {
      btManifoldPoint& point = manifold->getContactPoint(i);
      point.m_positionWorldOnA = to_world_first * point.m_localPointA;
      point.m_positionWorldOnB = to_world_second * point.m_localPointB;
      point.m_normalWorldOnB = to_world_first.getBasis() * normals_[at];
      point.m_distance1 =
          (point.m_positionWorldOnA - point.m_positionWorldOnB).dot(point.m_normalWorldOnB);
      material.set(point);
      forget_impact(point, step);
      stop_next_place(point, first, second, frictions_[at++]);
      tell_owner(point, a, b);
      ++point.m_lifeTime;
    }
  }
}

Eigen::Vector3d Points::together(const btCollisionObject& first, const btCollisionObject& second,
                                 const Contact& contact, const Spring& spring) {
  // Points that push against each other, as of wedged bodies, separate nothing.
  Eigen::Vector3d together = Eigen::Vector3d::Zero();
  double apart = 0;
  closing_ *= 1 - spring.step / (3 * (spring.step + spring.relaxation));
  for (const ContactPatch& patch : std::span(contact.patches).first(contact.count)) {
    const double force = spring.at(patch.depth) * patch.area * patch.depth;
    if (!(force > 0)) continue;
    together += force * patch.normal;
    apart += force;
    const btVector3 middle = to_bullet(place_of(patch));
    const btVector3 motion =
        velocity_of(first, middle) - velocity_of(second, middle) + unsaid_at(middle);
    closing_ = std::max(closing_, to_eigen(motion).dot(patch.normal));
  }
  if (contact.count == 0) closing_ = 0;
  const double most = std::max(spring.push_out, spring.rebound * closing_);
  return apart > 0 ? Eigen::Vector3d(most / apart * together) : together;
}

void Points::set_spring(btManifoldPoint& point, const ContactPatch& patch, const Spring& spring,
                        const Eigen::Vector3d& together) const {
  // Bullet takes spring and damper, and computes from them the separating speed, depth · spring /
  // (step · spring + damper), and the impulse per unit of missing speed. At rest, against a placed
  // object, the force is the spring's.
  double stiffness = spring.at(patch.depth) * patch.area, relaxation = spring.relaxation;
  if (patch.depth > 0) {
    const double parting = spring.parting(patch.depth, together.dot(patch.normal));
    // A point that moves along grows faster the deeper it is, so a small speed is no reference.
    const double placed = to_eigen(unsaid_at(to_bullet(place_of(patch)))).dot(patch.normal);
    const double speed =
        parting +
        std::max(0.0, placed) * std::min(1.0, patch.depth / std::max(0.2 * spring.rest, 1e-300));
    stiffness *= speed / parting;
    relaxation = patch.depth / speed - spring.step;
  }
  point.m_contactPointFlags |= BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING;
  point.m_combinedContactStiffness1 = static_cast<btScalar>(stiffness);
  point.m_combinedContactDamping1 = static_cast<btScalar>(stiffness * relaxation);
}

void Points::fill(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
                  const Contact& contact, const Spring& spring, btDispatcher& dispatcher) {
  const btCollisionObject &first = *a.getCollisionObject(), &second = *b.getCollisionObject();
  OldPoints old(manifolds, frictions_);
  const bool touched = old.count > 0;
  const Eigen::Vector3d pushed = together(first, second, contact, spring);
  const Material material(first, second);

  // Bullet's normal pushes the manifold's first body.
  const btTransform to_first = first.getWorldTransform().inverse();
  const btTransform to_second = second.getWorldTransform().inverse();
  std::array<btManifoldPoint, Settings::kPatches> points;
  std::array<bool, Settings::kPatches> named{};
  std::size_t used = 0;
  for (const ContactPatch& patch : std::span(contact.patches).first(contact.count)) {
    if (!(patch.area > 0)) continue;
    const btVector3 normal = to_bullet(Eigen::Vector3d(-patch.normal));
    const btVector3 middle = to_bullet(place_of(patch));
    const btScalar depth = static_cast<btScalar>(patch.depth);
    const btVector3 on_first = middle - normal * (depth / 2);
    const btVector3 on_second = middle + normal * (depth / 2);
    btManifoldPoint point(to_first * on_first, to_second * on_second, normal, -depth);
    point.m_positionWorldOnA = on_first;
    point.m_positionWorldOnB = on_second;
    material.set(point);
    const double approach =
        normal.dot(velocity_of(second, on_second) - velocity_of(first, on_first));
    if (point.m_combinedRestitution > 0 && approach > spring.slow) {
      if (patch.depth < 0) continue;  // else the gap would reduce the speed
      // A damped spring would absorb the speed, so a bouncing point is rigid in this step.
      point.m_contactPointFlags |=
          BT_CONTACT_FLAG_HAS_CONTACT_CFM | BT_CONTACT_FLAG_HAS_CONTACT_ERP;
    } else {
      set_spring(point, patch, spring, pushed);
    }
    set_name(point, patch.id);
    frictions_[used].setZero();
    named[used] = old.give_to(point, frictions_[used], spring.step);
    points[used++] = point;
  }
  for (std::size_t i = 0; i < old.count; ++i) {
    // Reports to owners of user data that the old point is gone; its impulses may continue.
    manifolds[0]->clearUserCache(old.points[i]);
  }
  for (std::size_t i = 0; i < used; ++i) {
    btManifoldPoint& point = points[i];
    if (!named[i]) old.give_impulse_to(point, frictions_[i], spring.step);
    stop_next_place(point, first, second, frictions_[i]);
    tell_owner(point, a, b);
    normals_[i] = to_first.getBasis() * point.m_normalWorldOnB;
    const std::size_t at = i / kPointsOfAManifold;
    if (at == manifolds.size()) manifolds.push_back(dispatcher.getNewManifold(&first, &second));
    btPersistentManifold& manifold = *manifolds[at];
    // Disables Bullet's own removal of points, as for a compound's children.
    manifold.setContactBreakingThreshold(BT_LARGE_FLOAT);
    manifold.setNumContacts(manifold.getNumContacts() + 1);
    manifold.getContactPoint(manifold.getNumContacts() - 1) = point;
  }
  if (used > 0 && !touched && gContactStartedCallback != nullptr) {
    gContactStartedCallback(manifolds[0]);
  }
  if (used == 0 && touched && gContactEndedCallback != nullptr) gContactEndedCallback(manifolds[0]);
}

}  // namespace ist::bullet
