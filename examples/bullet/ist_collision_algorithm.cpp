#include "ist_collision_algorithm.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btConvexConvexAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include "ist_shape.h"
#include "to_bullet.h"

namespace {

constexpr int kPointsOfAManifold = MANIFOLD_CACHE_SIZE;

/// A patch's name in the fields in which Bullet keeps the triangles of a point.
void set_name(btManifoldPoint& point, std::uint64_t id) {
  point.m_partId0 = static_cast<int>(id >> 32);
  point.m_index0 = static_cast<int>(id & 0xffffffffu);
}
bool same_name(const btManifoldPoint& a, const btManifoldPoint& b) {
  return a.m_partId0 == b.m_partId0 && a.m_index0 == b.m_index0;
}

btRigidBody* movable(const btCollisionObject* object) {
  btRigidBody* const body = btRigidBody::upcast(const_cast<btCollisionObject*>(object));
  return body != nullptr && body->getInvMass() > 0 ? body : nullptr;
}

}  // namespace

void IstContacts::register_with(btCollisionDispatcher& dispatcher) {
  create_.contacts = this;
  for (const int other :
       {IstShape::kType, static_cast<int>(STATIC_PLANE_PROXYTYPE),
        static_cast<int>(BOX_SHAPE_PROXYTYPE), static_cast<int>(SPHERE_SHAPE_PROXYTYPE),
        static_cast<int>(TERRAIN_SHAPE_PROXYTYPE)}) {
    dispatcher.registerCollisionCreateFunc(IstShape::kType, other, &create_);
    dispatcher.registerCollisionCreateFunc(other, IstShape::kType, &create_);
  }
}

btCollisionAlgorithm* IstContacts::CreateFunc::CreateCollisionAlgorithm(
    btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper*,
    const btCollisionObjectWrapper*) {
  static_assert(sizeof(IstCollisionAlgorithm) <= sizeof(btConvexConvexAlgorithm));
  void* const place = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(IstCollisionAlgorithm));
  return new (place) IstCollisionAlgorithm(info, *contacts);
}

IstCollisionAlgorithm::IstCollisionAlgorithm(const btCollisionAlgorithmConstructionInfo& info,
                                             IstContacts& contacts)
    : btActivatingCollisionAlgorithm(info), contacts_(contacts), state_(new State) {}

IstCollisionAlgorithm::~IstCollisionAlgorithm() {
  for (btPersistentManifold* manifold : state_->manifolds) m_dispatcher->releaseManifold(manifold);
}

void IstCollisionAlgorithm::processCollision(const btCollisionObjectWrapper* a,
                                             const btCollisionObjectWrapper* b,
                                             const btDispatcherInfo&, btManifoldResult*) {
  if (contacts_.settings.response != IstSettings::Response::solver) return;
  const btCollisionObject& first = *a->getCollisionObject();
  const btCollisionObject& second = *b->getCollisionObject();
  const IstPair pair = pair_of(first, second);
  if (pair.b == nullptr) return;
  const btTransform b_in_a = pair.a->getWorldTransform().inverseTimes(pair.b->getWorldTransform());
  if (state_->still > 0 && largest_motion(pair, state_->b_in_a, b_in_a) <= state_->still) {
    move_points(first, second);
    return;
  }
  IstContact contact;
  if (find_contact(first, second, contacts_.settings.patches, contacts_.settings.query,
                   contacts_.workspace, contact)) {
    fill_manifolds(&first, &second, contact);
    state_->b_in_a = b_in_a;
    state_->still = std::max(contacts_.settings.follow, contact.clearance);
  }
}

void IstCollisionAlgorithm::move_points(const btCollisionObject& first,
                                        const btCollisionObject& second) {
  const btTransform& to_world_first = first.getWorldTransform();
  const btTransform& to_world_second = second.getWorldTransform();
  std::size_t at = 0;
  for (btPersistentManifold* manifold : state_->manifolds) {
    for (int i = 0; i < manifold->getNumContacts(); ++i) {
      btManifoldPoint& point = manifold->getContactPoint(i);
      point.m_positionWorldOnA = to_world_first * point.m_localPointA;
      point.m_positionWorldOnB = to_world_second * point.m_localPointB;
      point.m_normalWorldOnB = to_world_first.getBasis() * state_->normals[at++];
      point.m_distance1 =
          (point.m_positionWorldOnA - point.m_positionWorldOnB).dot(point.m_normalWorldOnB);
      ++point.m_lifeTime;
    }
  }
}

void IstCollisionAlgorithm::fill_manifolds(const btCollisionObject* first,
                                           const btCollisionObject* second,
                                           const IstContact& contact) {
  std::array<btManifoldPoint, IstSettings::kPatches> old;
  std::size_t old_count = 0;
  for (btPersistentManifold* manifold : state_->manifolds) {
    for (int i = 0; i < manifold->getNumContacts(); ++i) {
      old[old_count++] = manifold->getContactPoint(i);
    }
    manifold->clearManifold();
  }

  const IstSettings& settings = contacts_.settings;
  // Bullet's normal pushes the manifold's first body.
  const double sign = contact.pair.b == second ? -1 : 1;
  const btTransform to_first = first->getWorldTransform().inverse();
  const btTransform to_second = second->getWorldTransform().inverse();
  std::size_t used = 0;
  for (std::size_t i = 0; i < contact.count; ++i) {
    const ist::ContactPatch& patch = contact.patches[i];
    if (!(patch.area > 0)) continue;
    const btVector3 normal = to_bullet(Eigen::Vector3d(sign * patch.normal));
    const btVector3 middle = to_bullet(patch.centroid);
    const btVector3 on_first = middle - normal * (0.5 * patch.depth);
    const btVector3 on_second = middle + normal * (0.5 * patch.depth);
    btManifoldPoint point(to_first * on_first, to_second * on_second, normal, -patch.depth);
    point.m_contactPointFlags |= BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING;
    point.m_combinedContactStiffness1 = settings.law.stiffness * patch.area;
    point.m_combinedContactDamping1 = settings.relaxation * point.m_combinedContactStiffness1;
    point.m_positionWorldOnA = on_first;
    point.m_positionWorldOnB = on_second;
    point.m_combinedFriction = btManifoldResult::calculateCombinedFriction(first, second);
    point.m_combinedRestitution = btManifoldResult::calculateCombinedRestitution(first, second);
    set_name(point, patch.id);
    for (std::size_t k = 0; k < old_count; ++k) {
      if (!same_name(old[k], point)) continue;
      point.m_appliedImpulse = old[k].m_appliedImpulse;
      point.m_appliedImpulseLateral1 = old[k].m_appliedImpulseLateral1;
      point.m_appliedImpulseLateral2 = old[k].m_appliedImpulseLateral2;
      point.m_lateralFrictionDir1 = old[k].m_lateralFrictionDir1;
      point.m_lateralFrictionDir2 = old[k].m_lateralFrictionDir2;
      point.m_lifeTime = old[k].m_lifeTime + 1;
    }
    state_->normals[used] = to_first.getBasis() * normal;
    const std::size_t at = used++ / kPointsOfAManifold;
    if (at == state_->manifolds.size()) {
      state_->manifolds.push_back(m_dispatcher->getNewManifold(first, second));
    }
    state_->manifolds[at]->addManifoldPoint(point);
  }
}

void IstCollisionAlgorithm::getAllContactManifolds(btManifoldArray& manifolds) {
  for (btPersistentManifold* manifold : state_->manifolds) manifolds.push_back(manifold);
}

void IstCollisionAlgorithm::push(const btCollisionObject& first, const btCollisionObject& second,
                                 double step) {
  const IstSettings& settings = contacts_.settings;
  state_->pushed = {};
  const bool whole = settings.law.area > 0;
  IstContact contact;
  if (!find_contact(first, second, whole ? 1 : settings.patches, settings.query,
                    contacts_.workspace, contact)) {
    return;
  }
  state_->pushed_body = contact.pair.b;
  if (contact.whole.volume <= 0) {
    state_->memory = {};
    return;
  }
  if (whole) contact.patches[0] = ist::whole_patch(contact.whole);  // of one name in every pose

  const Eigen::Vector3d origin(contact.pair.tree_b.pose.t);
  btRigidBody* const a = movable(contact.pair.a);
  btRigidBody* const b = movable(contact.pair.b);
  const auto twist_of = [](const btRigidBody* body) {
    if (body == nullptr) return ist::Twist();
    return ist::Twist{to_eigen(body->getCenterOfMassPosition()),
                      to_eigen(body->getLinearVelocity()), to_eigen(body->getAngularVelocity())};
  };
  const ist::RelativeMotion motion = ist::relative_motion(twist_of(a), twist_of(b), origin);
  ist::ContactLaw law = settings.law;
  law.friction = btManifoldResult::calculateCombinedFriction(&first, &second);
  state_->pushed = ist::contact_force(law, std::span(contact.patches).first(contact.count), motion,
                                      origin, step, state_->memory);
  // Impulses, since forces would act again in every further substep of one stepSimulation().
  const auto give = [&](btRigidBody* body, double sign) {
    if (body == nullptr) return;
    const Eigen::Vector3d arm = origin - to_eigen(body->getCenterOfMassPosition());
    const ist::ContactForce& f = state_->pushed;
    body->applyCentralImpulse(to_bullet(Eigen::Vector3d(sign * step * f.force)));
    body->applyTorqueImpulse(
        to_bullet(Eigen::Vector3d(sign * step * (f.torque + arm.cross(f.force)))));
  };
  give(b, 1);
  give(a, -1);
}
