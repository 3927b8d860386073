#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionDispatcherMt.h>
#include <btBulletDynamicsCommon.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <ist/bullet/contacts.h>
#include <ist/bullet/convert.h>

#include "support/baked.h"
#include "support/test_meshes.h"

// A Bullet world with assets in it, and its warnings.

namespace ist::testing {

inline btTransform at_place(const btVector3& place) {
  return btTransform(btQuaternion::getIdentity(), place);
}

/// A cube of side 1 about the origin.
inline const AssetView& cube() {
  static const Asset asset = baked(cube_mesh(), "cube", 4000);
  static const AssetView view = asset.view();
  return view;
}

inline std::unique_ptr<bullet::Shape> cube_of_side(double side) {
  auto shape = std::make_unique<bullet::Shape>(cube());
  shape->setLocalScaling(btVector3(side, side, side));
  return shape;
}

class World {
 public:
  World() {
    contacts.register_with(dispatcher_);
    world.setGravity({0, 0, -9.81});
    world.getSolverInfo().m_splitImpulse = false;
  }
  ~World() {
    for (const auto& body : bodies_) world.removeRigidBody(body.get());
  }

  /// Mass 0: held still. The shape is the world's.
  btRigidBody& add(std::unique_ptr<btCollisionShape> shape, double mass, const btTransform& at) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(mass, inertia);
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape.get(), inertia);
    info.m_startWorldTransform = at;
    bodies_.push_back(std::make_unique<btRigidBody>(info));
    bodies_.back()->setActivationState(DISABLE_DEACTIVATION);
    world.addRigidBody(bodies_.back().get());
    shapes_.push_back(std::move(shape));
    return *bodies_.back();
  }
  btRigidBody& add(std::unique_ptr<btCollisionShape> shape, double mass, const btVector3& at) {
    return add(std::move(shape), mass, at_place(at));
  }
  void add_ground() {
    add(std::make_unique<btStaticPlaneShape>(btVector3(0, 0, 1), 0), 0, {0, 0, 0});
  }
  void step(int steps, const std::function<void()>& each = {}, double hz = 240) {
    for (int i = 0; i < steps; ++i) {
      world.stepSimulation(btScalar(1 / hz), 0);
      if (each) each();
    }
  }

  bullet::Contacts contacts;

 private:
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcherMt dispatcher_{
      (btSetTaskScheduler(btGetSequentialTaskScheduler()), &configuration_)};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;

 public:
  btDiscreteDynamicsWorld world{&dispatcher_, &broadphase_, &solver_, &configuration_};
};

inline std::vector<std::string> warned;
class Listen {
 public:
  Listen() {
    warned.clear();
    bullet::set_warning_handler([](const char* sentence) { warned.push_back(sentence); });
  }
  ~Listen() { bullet::set_warning_handler(nullptr); }
};

}  // namespace ist::testing
