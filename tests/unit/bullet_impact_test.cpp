// Impacts in Bullet: what bodies do next that are first seen deep in each other, or wholly inside.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "support/bullet_world.h"

namespace ist::testing {
namespace {

using bullet::Shape;

struct Solid {
  const char* name;
  AssetView tree;
};

/// Bodies of 0.1 to 0.2 m.
const std::vector<Solid>& solids() {
  static const Asset ring = baked(torus_mesh(0.045, 0.015, 32, 16), "ring", 500);
  static const Asset plate = baked(box_mesh({-0.1, -0.1, -0.01}, {0.1, 0.1, 0.01}), "plate", 500);
  static const Asset box = baked(box_mesh({0, 0, 0}, {0.1, 0.1, 0.1}), "box", 500);
  static const std::vector<Solid> all = {
      {"ring", ring.view()}, {"plate", plate.view()}, {"box", box.view()}};
  return all;
}

double kinetic(const btRigidBody& body) {
  const btVector3 turning =
      body.getWorldTransform().getBasis().transpose() * body.getAngularVelocity();
  double sum = 0.5 * body.getLinearVelocity().length2() / body.getInvMass();
  for (int k = 0; k < 3; ++k)
    sum += 0.5 * turning[k] * turning[k] / body.getInvInertiaDiagLocal()[k];
  return sum;
}

std::size_t points_of(World& world) {
  btDispatcher& dispatcher = *world.world.getDispatcher();
  std::size_t sum = 0;
  for (int m = 0; m < dispatcher.getNumManifolds(); ++m)
    sum += static_cast<std::size_t>(dispatcher.getManifoldByIndexInternal(m)->getNumContacts());
  return sum;
}

/// A fall on a floor at height 0, turned at random: the largest energy with which the body leaves
/// the floor over that with which it meets it. Height is counted from where they meet. `threshold`:
/// [u] of its motion in a step.
double energy_kept(World& world, const AssetView& tree, const btQuaternion& turn, double above,
                   double fallen, double hz, double threshold = 0) {
  auto shape = std::make_unique<Shape>(tree);
  const double reach = shape->reach(), mass = 1000 * shape->volume();
  btRigidBody& body =
      world.add(std::move(shape), mass, btTransform(turn, {0, 0, btScalar(reach + above)}));
  body.setLinearVelocity({0, 0, btScalar(-std::sqrt(2 * 9.81 * fallen))});
  body.setCcdMotionThreshold(btScalar(threshold));
  const auto height_of = [&] { return body.getWorldTransform().getOrigin().z(); };
  double before = 0, after = 0, meeting = 0, last_height = height_of();
  double last_energy = kinetic(body);
  int steps = 0;
  world.step(
      static_cast<int>(0.6 * hz),
      [&] {
        const std::size_t points = points_of(world);
        if (before == 0 && points > 0) before = last_energy, meeting = last_height;
        last_energy = kinetic(body);
        last_height = height_of();
        if (++steps > 0.1 * hz && before > 0 && points == 0)
          after = std::max(after, last_energy + mass * 9.81 * (last_height - meeting));
      },
      hz);
  EXPECT_GT(before, 0);
  return after / before;
}

// Seen at 60 Hz a body is up to its whole size deep when it is first met. What a bed of springs
// would have stored at that depth nobody has put in.
TEST(BulletImpact, ABodyThatFallsGainsNoEnergy) {
  for (const Solid& solid : solids()) {
    for (const double hz : {60, 120, 240, 1000}) {
      for (const double height : {0.1, 1.0, 10.0}) {
        std::mt19937 random(3);
        const auto draw = [&] { return static_cast<double>(random()) / 2147483648.0 - 1; };
        for (int turn = 0; turn < 6; ++turn) {
          World world;
          world.contacts.configure(world.world);
          world.add_ground();
          btQuaternion way(draw(), draw(), draw(), draw());
          way = turn == 0 ? btQuaternion::getIdentity() : way.normalized();
          ASSERT_LE(energy_kept(world, solid.tree, way, 0.01 * (1 + draw()), height, hz), 0.3)
              << solid.name << " turned " << turn << " falls " << height << " m at " << hz << " Hz";
          ASSERT_GT(world.world.getCollisionObjectArray()[1]->getWorldTransform().getOrigin().z(),
                    0);
        }
      }
    }
  }
}

// A corner that meets the floor fast must not let other corners part fast later on: thin bodies
// rebounded with twice as much energy in the mean. Stopped by Contacts they turned on in slow
// motion, with up to 0.8 of their energy.
TEST(BulletImpact, WhatIsThinLeavesWithLittleEnergy) {
  const Asset plate = baked(box_mesh({-0.05, -0.05, -0.001}, {0.05, 0.05, 0.001}), "thin", 500);
  const Asset bar = baked(box_mesh({-0.05, -0.004, -0.004}, {0.05, 0.004, 0.004}), "bar", 500);
  const Asset floor = baked(box_mesh({-1, -1, -0.5}, {1, 1, 0}), "floor", 500);
  for (const auto& [solid, threshold] :
       {std::pair{&plate, 0.0}, {&plate, 0.001}, {&bar, 0.0}, {&bar, 0.004}}) {
    constexpr int kFalls = 40;
    double mean = 0;
    std::mt19937 random(3);
    const auto draw = [&] { return static_cast<double>(random()) / 2147483648.0 - 1; };
    for (int i = 0; i < kFalls; ++i) {
      World world;
      world.contacts.configure(world.world);
      if (threshold > 0) world.world.addAction(&world.contacts);
      world.add(std::make_unique<Shape>(floor.view()), 0, btVector3(0, 0, -0.25));
      const btQuaternion way(draw(), draw(), draw(), draw());
      const double kept = energy_kept(world, solid->view(), way.normalized(), 0.01 * (1 + draw()),
                                      1, 60, threshold);
      EXPECT_LT(kept, threshold > 0 ? 0.2 : 0.4) << i;
      mean += kept / kFalls;
    }
    EXPECT_LT(mean, threshold > 0 ? 0.05 : 0.03);
  }
}

TEST(BulletImpact, RestitutionIsKeptAtAllSpeeds) {
  for (const Solid& solid : solids()) {
    for (const double hz : {60, 240}) {
      for (const double e : {0.0, 0.5}) {
        for (const double speed : {0.3, 1.0, 3.0, 10.0}) {
          World world;
          world.world.setGravity({0, 0, 0});
          world.add_ground();
          auto shape = std::make_unique<Shape>(solid.tree);
          btVector3 lower, upper;
          shape->getAabb(btTransform::getIdentity(), lower, upper);
          btRigidBody& body = world.add(std::move(shape), 1, btVector3(0, 0, 0.001 - lower.z()));
          body.setRestitution(e);
          world.world.getCollisionObjectArray()[0]->setRestitution(1);
          body.setLinearVelocity({0, 0, -speed});
          double fastest = 0;
          world.step(
              static_cast<int>(0.25 * hz),
              [&] { fastest = std::max<double>(fastest, body.getLinearVelocity().z()); }, hz);
          // Without restitution as a critically damped spring, or as slowly as it pushes out.
          const double least = e > 0 ? e - 0.05 : 0, most = e > 0 ? e + 0.05 : std::exp(-2.0);
          EXPECT_GE(fastest, least * speed) << solid.name << hz << " " << speed;
          EXPECT_LE(fastest, most * speed + (e > 0 ? 0 : 0.25))
              << solid.name << " at " << hz << " Hz, " << speed << " m/s, " << e;
        }
      }
    }
  }
}

TEST(BulletImpact, OverlappingBodiesPartAtTheSpeedThatIsSet) {
  for (const double limit : {0.0, 0.05, 0.5}) {
    World world;
    world.contacts.configure(world.world);
    world.world.setGravity({0, 0, 0});
    world.contacts.settings.push_out = limit;
    std::vector<btRigidBody*> boxes;
    for (int i = 0; i < 2; ++i)
      boxes.push_back(&world.add(cube_of_side(0.2), 1, btVector3(0.01 * i, 0.02 * i, 0.1 * i)));
    double fastest = 0;
    world.step(960, [&] {
      fastest = std::max<double>(
          fastest, (boxes[1]->getLinearVelocity() - boxes[0]->getLinearVelocity()).length());
    });
    EXPECT_LT(fastest, limit > 0 ? 2 * limit : 1) << limit;
    if (limit == 0.5) {
      EXPECT_EQ(points_of(world), 0u);
    }
  }
}

int inside_started = 0;

// A solid wholly inside another has no side that the volume leads to: the nearest one does.
TEST(BulletInside, IsAContactThatLeadsOut) {
  const auto shape_of = [](int kind, double half) -> std::unique_ptr<btCollisionShape> {
    if (kind == 0) return std::make_unique<btBoxShape>(btVector3(half, half, half));
    if (kind == 1) return std::make_unique<btSphereShape>(half);
    return cube_of_side(2 * half);
  };
  for (const int outer : {0, 1, 2}) {
    for (const int inner : {0, 1, 2}) {
      if (outer != 2 && inner != 2) continue;
      SCOPED_TRACE(std::to_string(inner) + " in " + std::to_string(outer));
      inside_started = 0;
      gContactStartedCallback = [](btPersistentManifold* const&) { ++inside_started; };
      World world;
      world.world.setGravity({0, 0, 0});
      world.contacts.settings.push_out = 1;
      world.add(shape_of(outer, 1), 0, btVector3(0, 0, 0));
      btRigidBody& body = world.add(shape_of(inner, 0.1), 1, btVector3(0.1, 0, 0.6));
      world.step(1);
      EXPECT_EQ(inside_started, 1);
      EXPECT_GT(points_of(world), 0u);
      world.step(240);
      EXPECT_GT(body.getWorldTransform().getOrigin().z(), 1.09);
      EXPECT_EQ(points_of(world), 0u);
      gContactStartedCallback = nullptr;
    }
  }
}

TEST(BulletInside, IsAnEventOfASensorWithoutAPush) {
  inside_started = 0;
  gContactStartedCallback = [](btPersistentManifold* const&) { ++inside_started; };
  World world;
  world.world.setGravity({0, 0, 0});
  btRigidBody& sensor = world.add(cube_of_side(1), 0, btVector3(0, 0, 0));
  sensor.setCollisionFlags(sensor.getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
  btRigidBody& body = world.add(cube_of_side(0.1), 1, btVector3(0.1, 0, 0.2));
  world.step(10);
  EXPECT_EQ(inside_started, 1);
  EXPECT_EQ(body.getLinearVelocity().length(), 0);
  struct Count : btCollisionWorld::ContactResultCallback {
    int points = 0;
    btScalar addSingleResult(btManifoldPoint&, const btCollisionObjectWrapper*, int, int,
                             const btCollisionObjectWrapper*, int, int) override {
      return static_cast<btScalar>(++points);
    }
  } count;
  world.world.contactTest(&body, count);
  EXPECT_EQ(count.points, 1);
  gContactStartedCallback = nullptr;
}

TEST(BulletInside, AHalfSpaceLetsNothingThrough) {
  for (const double speed : {30.0, 300.0}) {
    for (const Solid& solid : solids()) {
      World world;
      world.add_ground();
      btRigidBody& body = world.add(std::make_unique<Shape>(solid.tree), 1, btVector3(0, 0, 0.3));
      body.setLinearVelocity({0, 0, -speed});
      double lowest = 0;
      world.step(
          600, [&] { lowest = std::min<double>(lowest, body.getWorldTransform().getOrigin().z()); },
          60);
      EXPECT_GT(lowest, -speed / 60);
      EXPECT_LT(body.getLinearVelocity().length(), speed / 100) << solid.name;
    }
  }
}

// Placed in every step, and given no speed.
TEST(BulletInside, AFloorThatIsPlacedLifts) {
  for (const double hz : {60, 240}) {
    World world;
    world.contacts.configure(world.world);
    btRigidBody& floor = world.add(cube_of_side(0.2), 0, btVector3(0, 0, 0));
    floor.setCollisionFlags(floor.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    btRigidBody& body = world.add(cube_of_side(0.2), 1, btVector3(0, 0, 0.2));
    double worst = 0;
    int steps = 0;
    world.step(
        static_cast<int>(2 * hz),
        [&] {
          const double z = floor.getWorldTransform().getOrigin().z();
          worst = std::max(worst, std::abs(body.getWorldTransform().getOrigin().z() - z - 0.2));
          const double next = 0.25 * (1 - std::cos(++steps / hz * SIMD_PI));
          floor.setWorldTransform(at_place({0, 0, btScalar(next)}));
          floor.setInterpolationWorldTransform(floor.getWorldTransform());
        },
        hz);
    EXPECT_LT(worst, hz > 100 ? 0.01 : 0.04) << hz;
  }
}

TEST(BulletWorld, WarnsOnceOfEach) {
  const Listen listen;
  for (int k = 0; k < 2; ++k) {
    World world;
    world.add(cube_of_side(1), 1, btVector3(0, 0, 0));
    const btVector3 at(0, 0, 0);
    const btScalar radius = 1;
    for (int i = 0; i < 2; ++i)
      world.add(std::make_unique<btMultiSphereShape>(&at, &radius, 1), 0, btVector3(0, 0, 0));
    world.step(3);
  }
  EXPECT_EQ(warned.size(), 2u);
}

// A contact that holds is asked anew by what an engine changes.
TEST(BulletMaterial, ChangesOfTheQueryCountWhileABodyRests) {
  World world;
  world.add_ground();
  world.add(cube_of_side(0.2), 1, btVector3(0, 0, 0.1));
  world.step(240);
  ASSERT_EQ(points_of(world), 4u);
  world.contacts.settings.patches = 3;
  world.step(1);
  EXPECT_LE(points_of(world), 3u);
}

}  // namespace
}  // namespace ist::testing
