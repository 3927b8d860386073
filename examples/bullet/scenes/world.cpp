#include "world.h"

#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <ist/bullet/convert.h>

#include <ctime>
#include <stdexcept>

#include "scene_broadphase.h"

using ist::bullet::to_bullet;
using ist::bullet::to_eigen;

const char* name_of(Way way) {
  switch (way) {
    case Way::solver:
      return "ist, patches in the solver";
    case Way::wrench:
      return "ist, wrench in the tick";
    case Way::gimpact:
      return "GImpact";
    case Way::hulls:
      return "convex hulls";
    case Way::own:
      return "Bullet's boxes, one hull a part";
  }
  return "";
}

namespace {

std::unique_ptr<btBroadphaseInterface> make_broadphase(const WorldSettings& settings) {
  if (!settings.by_scene) return std::make_unique<btDbvtBroadphase>();
  return std::make_unique<SceneBroadphase>(1024);
}

/// Of this thread. std::clock() is the whole process's, which advances by ticks of milliseconds
/// while a limit of its processor time is set.
double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

SceneWorld::SceneWorld(const WorldSettings& settings)
    : settings_(settings), broadphase_(make_broadphase(settings)) {
  contacts_.settings = settings.ist;
  contacts_.settings.response = settings.way == Way::wrench
                                    ? ist::bullet::Settings::Response::wrench
                                    : ist::bullet::Settings::Response::solver;
  btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher_);
  contacts_.configure(world_);
  world_.setGravity(to_bullet(settings.gravity));
  // Bullet's own contacts part bodies as it does by default.
  world_.getSolverInfo().m_splitImpulse =
      settings.way != Way::solver && settings.way != Way::wrench;
  world_.addAction(&contacts_);  // stops bodies that ask for it
  if (settings.way == Way::wrench) ist::bullet::push_in_every_tick(world_);
}

SceneWorld::~SceneWorld() {
  for (Body& body : bodies_) world_.removeRigidBody(body.rigid.get());
}

btCollisionShape* SceneWorld::shape_of(const Part& part) {
  if (settings_.way == Way::solver || settings_.way == Way::wrench) {
    std::unique_ptr<ist::bullet::Shape>& shape = ist_shapes_[&part];
    if (shape == nullptr) shape = std::make_unique<ist::bullet::Shape>(part.tree());
    return shape.get();
  }
  std::unique_ptr<PeerShape>& shape = peer_shapes_[&part];
  if (shape == nullptr) {
    shape = settings_.way == Way::gimpact ? make_gimpact_shape(part, settings_.margin)
            : settings_.way == Way::own   ? make_own_shape(part, settings_.margin)
            : settings_.hulls == 0        ? make_hull_shape(part, settings_.margin)
                                   : make_hulls_shape(part, settings_.hulls, settings_.margin);
    if (shape == nullptr)
      throw std::runtime_error("no convex decomposition here: dev setup --bullet");
  }
  return shape->shape.get();
}

btRigidBody& SceneWorld::add(Body body, btCollisionShape* shape, double mass, const btTransform& at,
                             double friction) {
  btVector3 inertia(0, 0, 0);
  if (mass > 0) inertia = mass * to_bullet(body.part->frame().unit_inertia);
  btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape, inertia);
  info.m_startWorldTransform = at;
  info.m_friction = friction;
  body.rigid = std::make_unique<btRigidBody>(info);
  body.rigid->setActivationState(DISABLE_DEACTIVATION);
  world_.addRigidBody(body.rigid.get());
  body.proxy = std::make_unique<btCollisionObject>();
  body.proxy->setCollisionShape(body.proxy_shape != nullptr ? body.proxy_shape.get() : shape);
  bodies_.push_back(std::move(body));
  return *bodies_.back().rigid;
}

btRigidBody& SceneWorld::add(const Part& part, double density, const Eigen::Isometry3d& at,
                             double friction) {
  Body body;
  body.part = &part;
  body.proxy_shape = std::make_unique<ist::bullet::Shape>(part.tree());
  return add(std::move(body), shape_of(part), density * part.volume(),
             to_bullet(Eigen::Isometry3d(at * part.frame().in_mesh)), friction);
}

btRigidBody& SceneWorld::add_still(std::unique_ptr<btCollisionShape> shape,
                                   const Eigen::Isometry3d& at, double friction) {
  Body body;
  body.own_shape = std::move(shape);
  btCollisionShape* const raw = body.own_shape.get();
  return add(std::move(body), raw, 0, to_bullet(at), friction);
}

void SceneWorld::step() {
  const double start = processor_seconds();
  world_.stepSimulation(settings_.step, 0);
  seconds_ += processor_seconds() - start;
  ++steps_;
}

Eigen::Isometry3d SceneWorld::mesh_frame(const btRigidBody& body) const {
  for (const Body& known : bodies_) {
    if (known.rigid.get() != &body || known.part == nullptr) continue;
    return to_eigen(body.getWorldTransform()) * known.part->frame().in_mesh.inverse();
  }
  return to_eigen(body.getWorldTransform());
}

double SceneWorld::kinetic_energy() const {
  double sum = 0;
  for (const Body& body : bodies_) {
    if (body.rigid->getInvMass() == 0) continue;
    const btVector3 turning =
        body.rigid->getWorldTransform().getBasis().transpose() * body.rigid->getAngularVelocity();
    const btVector3 inverse = body.rigid->getInvInertiaDiagLocal();
    sum += 0.5 * body.rigid->getLinearVelocity().length2() / body.rigid->getInvMass();
    for (int k = 0; k < 3; ++k) sum += 0.5 * turning[k] * turning[k] / inverse[k];
  }
  return sum;
}

double SceneWorld::potential_energy() const {
  double sum = 0;
  for (const Body& body : bodies_) {
    if (body.rigid->getInvMass() == 0) continue;
    sum -= settings_.gravity.dot(to_eigen(body.rigid->getCenterOfMassPosition())) /
           body.rigid->getInvMass();
  }
  return sum;
}

double SceneWorld::contact_energy() const {
  double sum = 0;
  ist::bullet::for_each_pair(world_,
                             [&](ist::bullet::PairAlgorithm& pair, const btCollisionObject&,
                                 const btCollisionObject&) { sum += pair.pushed().energy; });
  return sum;
}

Eigen::Vector3d SceneWorld::contact_force(const btRigidBody& body) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  ist::bullet::for_each_pair(world_, [&](ist::bullet::PairAlgorithm& pair,
                                         const btCollisionObject& a, const btCollisionObject& b) {
    if (&a != &body && &b != &body) return;
    sum += (&b == &body ? 1 : -1) * pair.pushed().force;
  });
  for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
    const btPersistentManifold& manifold =
        *const_cast<btCollisionDispatcher&>(dispatcher_).getManifoldByIndexInternal(m);
    const bool first = manifold.getBody0() == &body;
    if (!first && manifold.getBody1() != &body) continue;
    for (int i = 0; i < manifold.getNumContacts(); ++i) {
      const btManifoldPoint& p = manifold.getContactPoint(i);
      const btVector3 impulse = p.m_appliedImpulse * p.m_normalWorldOnB +
                                p.m_appliedImpulseLateral1 * p.m_lateralFrictionDir1 +
                                p.m_appliedImpulseLateral2 * p.m_lateralFrictionDir2;
      sum += (first ? 1 : -1) / settings_.step * to_eigen(impulse);
    }
  }
  return sum;
}

double SceneWorld::deepest_penetration() {
  const ist::bullet::Settings settings;
  double deepest = 0;
  for (Body& body : bodies_) body.proxy->setWorldTransform(body.rigid->getWorldTransform());
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (bodies_[i].rigid->getInvMass() + bodies_[j].rigid->getInvMass() == 0) continue;
      btVector3 low_i, high_i, low_j, high_j;
      const auto box = [](const Body& b, btVector3& low, btVector3& high) {
        b.proxy->getCollisionShape()->getAabb(b.proxy->getWorldTransform(), low, high);
      };
      box(bodies_[i], low_i, high_i);
      box(bodies_[j], low_j, high_j);
      if (!TestAabbAgainstAabb2(low_i, high_i, low_j, high_j)) continue;
      ist::bullet::Contact contact;
      if (!find_contact(*bodies_[i].proxy, *bodies_[j].proxy, settings, contact)) continue;
      for (std::size_t k = 0; k < contact.count; ++k) {
        deepest = std::max(deepest, contact.patches[k].depth);
      }
    }
  }
  return deepest;
}
