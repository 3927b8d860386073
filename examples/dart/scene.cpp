#include "scene.h"

#include <ist/error.h>
#include <dart/collision/CollisionDetector.hpp>
#include <dart/collision/CollisionObject.hpp>
#include <dart/constraint/ConstraintSolver.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/WeldJoint.hpp>

#include <algorithm>
#include <chrono>

using Eigen::Vector3d;

namespace {

void add_shape(dart::dynamics::BodyNode* node, const dart::dynamics::ShapePtr& shape,
               double friction) {
  using namespace dart::dynamics;
  auto* frame = node->createShapeNodeWith<CollisionAspect, DynamicsAspect>(shape);
  frame->getDynamicsAspect()->setFrictionCoeff(friction);
}

}  // namespace

Scene::Scene(std::string name, const dart::dynamics::ShapePtr& ground,
             const std::shared_ptr<ist_dart::IstShape>& solid, const Eigen::Isometry3d& start,
             double friction)
    : name_(std::move(name)), world_(dart::simulation::World::create(name_)) {
  const auto detector = dart::collision::CollisionDetector::getFactory()->create("ist");
  if (!detector) throw ist::Error("DART knows no collision detector \"ist\": is it linked?");
  world_->getConstraintSolver()->setCollisionDetector(detector);
  world_->setGravity(Vector3d(0, 0, -kGravity));
  world_->setTimeStep(kTimeStep);

  const auto fixed = dart::dynamics::Skeleton::create("ground");
  add_shape(fixed->createJointAndBodyNodePair<dart::dynamics::WeldJoint>().second, ground,
            friction);
  const auto moving = dart::dynamics::Skeleton::create("body");
  dart::dynamics::FreeJoint* joint = nullptr;
  std::tie(joint, body_) = moving->createJointAndBodyNodePair<dart::dynamics::FreeJoint>();
  add_shape(body_, solid, friction);
  body_->setInertia(solid->inertia(kDensity));
  joint->setTransform(start);
  world_->addSkeleton(fixed);
  world_->addSkeleton(moving);
}

void Scene::run(double seconds) {
  using Clock = std::chrono::steady_clock;
  for (const double end = world_->getTime() + seconds; world_->getTime() < end - kTimeStep / 2;) {
    const Clock::time_point before = Clock::now();
    world_->step();
    wall_time_ += std::chrono::duration<double>(Clock::now() - before).count();
    samples_.push_back(look());
  }
}

Sample Scene::look() const {
  Sample now;
  now.time = world_->getTime();
  now.position = body_->getCOM();
  now.rotation = body_->getTransform().linear();
  now.speed = body_->getCOMLinearVelocity().norm();
  now.spin = body_->getAngularVelocity().norm();
  const auto skeleton = body_->getSkeleton();
  now.energy = skeleton->computeKineticEnergy() + skeleton->computePotentialEnergy();
  for (const auto& contact : world_->getLastCollisionResult().getContacts()) {
    const auto* shape = contact.collisionObject1->getShapeFrame()->asShapeNode();
    const bool first = shape->getBodyNodePtr() == body_;
    const Vector3d force = first ? contact.force : Vector3d(-contact.force);
    now.force += force;
    now.torque += (contact.point - now.position).cross(force);
    now.depth = std::max(now.depth, contact.penetrationDepth);
    ++now.contacts;
  }
  return now;
}

void Scene::expect_rest(double since, double arm) {
  const Vector3d up(0, 0, weight());
  expect("contact forces off the weight in any step, of the weight",
         largest(since, [&](const Sample& s) { return (s.force - up).norm() / weight(); }), 0,
         0.01);
  expect("moment of contact forces in any step, of weight x half length",
         largest(since, [&](const Sample& s) { return s.torque.norm() / (weight() * arm); }), 0,
         0.01);
  expect("speed [m/s]", largest(since, [](const Sample& s) { return s.speed; }), 0, 1e-3);
  expect("spin [rad/s]", largest(since, [](const Sample& s) { return s.spin; }), 0, 1e-2);
}
