#include <dart/collision/CollisionDetector.hpp>
#include <dart/collision/CollisionFilter.hpp>
#include <dart/collision/CollisionGroup.hpp>
#include <dart/collision/CollisionObject.hpp>
#include <dart/collision/DistanceFilter.hpp>
#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/ConeShape.hpp>
#include <dart/dynamics/PlaneShape.hpp>
#include <dart/dynamics/SimpleFrame.hpp>
#include <dart/dynamics/SphereShape.hpp>

#include "ist_collision_detector.h"
#include "scene.h"

using dart::collision::CollisionObject;
using dart::collision::CollisionOption;
using dart::collision::CollisionResult;
using dart::collision::DistanceOption;
using dart::collision::DistanceResult;
using dart::dynamics::Frame;
using dart::dynamics::SimpleFrame;
using Eigen::Vector3d;

namespace {

struct IgnoreAll final : dart::collision::CollisionFilter {
  bool ignoresCollision(const CollisionObject*, const CollisionObject*) const override {
    return true;
  }
};

struct MeasureNone final : dart::collision::DistanceFilter {
  bool needDistance(const CollisionObject*, const CollisionObject*) const override { return false; }
};

dart::dynamics::SimpleFramePtr place(const dart::dynamics::ShapePtr& shape, const Vector3d& at) {
  auto frame = std::make_shared<SimpleFrame>(Frame::World());
  frame->setShape(shape);
  frame->setTranslation(at);
  return frame;
}

}  // namespace

std::vector<Truth> check_interface(const ist::TreeView& cube) {
  std::vector<Truth> truths;
  const auto yes = [&](std::string what, bool holds) {
    truths.push_back({std::move(what), holds ? 1.0 : 0.0, 1, 1});
  };
  const auto near = [&](std::string what, double measured, double truth, double error) {
    truths.push_back({std::move(what), measured, truth - error, truth + error});
  };

  const auto detector = dart::collision::CollisionDetector::getFactory()->create("ist");
  auto* ours = dynamic_cast<ist_dart::IstCollisionDetector*>(detector.get());
  yes("DART's factory makes the detector", ours != nullptr);
  if (ours == nullptr) return truths;

  // Unit cubes, and DART's shapes of the same extent below them.
  const auto solid = std::make_shared<ist_dart::IstShape>(cube);
  const Vector3d middle = (solid->getBoundingBox().getMin() + solid->getBoundingBox().getMax()) / 2;
  const auto upper = place(solid, {0, 0, 0});
  const auto all_upper = detector->createCollisionGroup(upper.get());
  const auto floor = std::make_shared<dart::dynamics::PlaneShape>(Vector3d::UnitZ(), middle.z());
  const std::pair<const char*, dart::dynamics::SimpleFramePtr> grounds[] = {
      {"cube", place(solid, Vector3d(0, 0, 0))},
      {"box", place(std::make_shared<dart::dynamics::BoxShape>(Vector3d::Ones()), middle)},
      {"plane", place(floor, {0, 0, 0.5})}};
  for (const auto& [name, ground] : grounds) {
    const std::string with = std::string(" (") + name + ")";
    const auto below = detector->createCollisionGroup(ground.get());
    CollisionResult result;

    upper->setTranslation(Vector3d(0, 0, 0.98));
    const CollisionOption contacts(true, 100);
    detector->collide(all_upper.get(), below.get(), contacts, &result);
    yes("contacts there" + with, result.getNumContacts() > 0);
    Vector3d first = Vector3d::Zero(), second = Vector3d::Zero();
    for (const auto& contact : result.getContacts()) first += contact.normal;
    detector->collide(below.get(), all_upper.get(), contacts, &result);
    for (const auto& contact : result.getContacts()) second += contact.normal;
    near("normal pushes object 1 up" + with, first.normalized().z(), 1, 1e-3);
    near("and down where it is the lower one" + with, second.normalized().z(), -1, 1e-3);
    detector->collide(all_upper.get(), below.get(), CollisionOption(true, 1), &result);
    near("contacts if one is asked for" + with, static_cast<double>(result.getNumContacts()), 1, 0);
    yes("a filter is heard" + with,
        !detector->collide(all_upper.get(), below.get(),
                           CollisionOption(true, 100, std::make_shared<IgnoreAll>()), &result));
    near("the slab's volume [m^3], as exact as shallow flats are" + with,
         ours->penetration(*ground, *upper).volume, 0.02, 0.002);

    upper->setTranslation(Vector3d(0, 0, 1.3));
    yes("apart is no collision" + with, !detector->collide(all_upper.get(), below.get()));
    DistanceResult nearest;
    near("distance [m]" + with,
         detector->distance(all_upper.get(), below.get(), DistanceOption(true), &nearest), 0.3,
         0.003);
    near("distance of the nearest points" + with,
         (nearest.nearestPoint1 - nearest.nearestPoint2).norm(), nearest.minDistance, 1e-9);
    yes("the first is of the upper one" + with,
        nearest.nearestPoint1.z() > nearest.nearestPoint2.z());
    near("lower bound of distances" + with,
         detector->distance(all_upper.get(), below.get(), DistanceOption(false, 0.7)), 0.7, 0);
    detector->distance(all_upper.get(), below.get(),
                       DistanceOption(false, 0, std::make_shared<MeasureNone>()), &nearest);
    yes("a distance filter is heard" + with, !nearest.found());
  }

  // A small cube wholly inside, where surfaces do not meet.
  const auto inside = place(std::make_shared<ist_dart::IstShape>(cube, 0.1), middle * 0.9);
  const auto big = place(solid, {0, 0, 0});
  const auto both = detector->createCollisionGroup(inside.get(), big.get());
  yes("wholly inside is a collision", detector->collide(both.get()));
  CollisionResult contained;
  detector->collide(both.get(), CollisionOption(true, 100), &contained);
  Vector3d push = Vector3d::Zero();
  for (const auto& contact : contained.getContacts()) push += contact.normal;
  near("and pushes nowhere", push.norm(), 0, 0);
  yes("rays are not supported", !detector->raycast(both.get(), {0, 0, 9}, {0, 0, -9}));

  // What has no query is told, and harms nothing.
  const auto cone = place(std::make_shared<dart::dynamics::ConeShape>(1, 1), {0, 0, 0});
  const auto ball = place(std::make_shared<dart::dynamics::SphereShape>(1), {0, 0, 0});
  yes("a cone meets nothing, two fields do not meet",
      !detector->collide(
          detector->createCollisionGroup(cone.get(), ball.get(), grounds[1].second.get()).get()));

  // A shape that changes is seen.
  const auto growing = std::make_shared<dart::dynamics::SphereShape>(0.1);
  const auto grown = place(growing, {0, 0, 3});
  upper->setTranslation(Vector3d::Zero());
  const auto seen = detector->createCollisionGroup(grown.get(), upper.get());
  const bool before = seen->collide();
  growing->setRadius(2.9);
  yes("a sphere that grows is seen", !before && seen->collide());
  return truths;
}
