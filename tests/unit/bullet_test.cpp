// Assets in Bullet: partners, contact events, resting depths.
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <BulletCollision/NarrowPhaseCollision/btRaycastCallback.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <thread>

#include "bullet/partner.h"
#include "support/bullet_world.h"

namespace ist::testing {
namespace {

// The default uses meshes: an asset without one still collides, by its spheres.
TEST(BulletShapes, WithoutAMeshCollideByLenses) {
  PackingSettings packing;
  packing.max_spheres = 500;
  packing.keep_mesh = false;
  const Asset asset = bake(close_mesh(cube_mesh(), "cube"), packing);
  ASSERT_FALSE(asset.view().has_mesh());
  bullet::Shape shape(asset.view());
  btCollisionObject first, second;
  first.setCollisionShape(&shape);
  second.setCollisionShape(&shape);
  second.setWorldTransform(at_place({0.9, 0.1, 0}));
  bullet::Contact contact;
  ASSERT_TRUE(bullet::find_contact(first, second, {}, contact));
  EXPECT_NEAR(contact.whole.volume, 0.09, 0.02);
  EXPECT_GT(contact.count, 0u);
}

// A query without an answer is no contact, and that is said.
TEST(BulletShapes, APlaceThatIsNoNumberIsSaid) {
  const Listen listen;
  const auto shape = cube_of_side(1);
  btCollisionObject first, second;
  first.setCollisionShape(shape.get());
  second.setCollisionShape(shape.get());
  second.setWorldTransform(at_place({NAN, 0, 0}));
  bullet::Contact contact;
  bullet::find_contact(first, second, {}, contact);
  EXPECT_EQ(contact.count, 0u);
  ASSERT_EQ(warned.size(), 1u);
  EXPECT_NE(warned[0].find("gave no answer"), std::string::npos) << warned[0];
}

// A query that its limit stops finds a part of the contact, and that is said.
TEST(BulletShapes, AQueryThatIsStoppedIsSaid) {
  const Listen listen;
  World world;
  world.contacts.settings.query.max_visits = 1;
  world.add_ground();
  world.add(cube_of_side(0.2), 1, btVector3(0, 0, 0.09));
  world.step(10);
  ASSERT_EQ(warned.size(), 1u);
  EXPECT_NE(warned[0].find("stopped a contact query"), std::string::npos) << warned[0];
}

std::vector<btVector3> corners(double half) {
  std::vector<btVector3> points;
  for (int i = 0; i < 8; ++i) {
    points.push_back({i & 1 ? half : -half, i & 2 ? half : -half, i & 4 ? half : -half});
  }
  return points;
}

double distance_to_box(const Eigen::Vector3d& x, double half) {
  const Eigen::Vector3d d = x.cwiseAbs().array() - half;
  return d.maxCoeff() <= 0 ? d.maxCoeff() : d.cwiseMax(0).norm();
}

TEST(BulletPartners, HullsTellTrueDistances) {
  std::vector<btVector3> points = corners(0.5);
  points.push_back({0.1, 0.2, 0});  // inside: no corner of the hull
  const bullet::HullDistance hull(points);
  EXPECT_EQ(hull.faces(), 6u);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> draw(-1, 1);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d x(draw(random), draw(random), draw(random));
    const ShapeSample sample = hull.at(x);
    EXPECT_NEAR(sample.distance, distance_to_box(x, 0.5), 1e-9);
    EXPECT_NEAR(sample.gradient.norm(), 1, 1e-9);
    // Along the gradient the distance grows at a rate of 1.
    EXPECT_NEAR(hull.at(x + 1e-6 * sample.gradient).distance, sample.distance + 1e-6, 1e-9);
  }
  EXPECT_LT(bullet::HullDistance({points[0], points[1], points[2], points[3]}).faces(), 4u);
}

TEST(BulletPartners, ConesTellTrueDistances) {
  const btConeShapeZ cone(0.4, 1.0);
  const auto partner = bullet::Partner::of(cone);
  ASSERT_TRUE(partner.has_value());
  const PlacedShape placed = partner->placed(btTransform::getIdentity(), {}, {}, 1);
  const auto& field = std::get<FunctionShape>(placed.shape);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> draw(-1, 1);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d x(draw(random), draw(random), draw(random));
    const ShapeSample sample = field.sample(field.context, x);
    // The nearest of many points of mantle and base, in the half-plane of x.
    const double out = x.head<2>().norm();
    double nearest = 10;
    for (int k = 0; k <= 4000; ++k) {
      const double t = k / 4000.0;
      nearest = std::min({nearest, std::hypot(out - 0.4 * t, x.z() + 0.5),
                          std::hypot(out - 0.4 * t, x.z() - (0.5 - t))});
    }
    const bool inside = x.z() > -0.5 && out < 0.4 * (0.5 - x.z());
    EXPECT_NEAR(sample.distance, inside ? -nearest : nearest, 1e-3) << x.transpose();
    EXPECT_NEAR(sample.gradient.norm(), 1, 1e-9);
    EXPECT_NEAR(field.sample(field.context, x + 1e-6 * sample.gradient).distance,
                sample.distance + 1e-6, 1e-9);
  }
}

struct Ground {
  const char* name;
  std::function<std::unique_ptr<btCollisionShape>()> make;
  btVector3 at;     // its flat top is at height 0
  double turn = 0;  // about x
};

std::unique_ptr<btCollisionShape> hull_of_box() {
  auto hull = std::make_unique<btConvexHullShape>();
  for (const btVector3& p : corners(1)) hull->addPoint(p);
  return hull;
}

TEST(BulletPartners, ACubeRestsOnEachOfThem) {
  static const std::vector<float> heights(9, 0.25f);
  static btBoxShape half_a_floor(btVector3(1, 2, 0.5));
  static bullet::Shape block(cube());
  const std::vector<Ground> grounds = {
      {"plane",
       [] { return std::make_unique<btStaticPlaneShape>(btVector3(0, 0, 1), 0); },
       {0, 0, 0}},
      {"box", [] { return std::make_unique<btBoxShape>(btVector3(1, 1, 0.5)); }, {0, 0, -0.5}},
      {"cylinder along y",
       [] { return std::make_unique<btCylinderShape>(btVector3(1, 0.5, 1)); },
       {0, 0, -0.5},
       SIMD_HALF_PI},
      {"cylinder along z",
       [] { return std::make_unique<btCylinderShapeZ>(btVector3(1, 1, 0.5)); },
       {0, 0, -0.5}},
      {"cone, base up", [] { return std::make_unique<btConeShapeZ>(1, 2); }, {0, 0, -1}, SIMD_PI},
      {"hull", hull_of_box, {0, 0, -1}},
      {"convex triangle mesh",
       [] {
         static btTriangleMesh mesh;
         if (mesh.getNumTriangles() == 0) {
           for (const btVector3& p : corners(0.5)) mesh.addTriangle(p, p, -p);
         }
         auto shape = std::make_unique<btConvexTriangleMeshShape>(&mesh);
         shape->setLocalScaling({2, 2, 2});
         return shape;
       },
       {0, 0, -1}},
      {"terrain",
       [] {
         auto terrain =
             std::make_unique<btHeightfieldTerrainShape>(3, 3, heights.data(), 0.f, 0.5f, 2, true);
         terrain->setLocalScaling({2, 2, 2});
         return terrain;
       },
       {0, 0, 0}},
      {"compound of boxes",
       [] {
         auto compound = std::make_unique<btCompoundShape>();
         compound->addChildShape(at_place({-1, 0, 0}), &half_a_floor);
         compound->addChildShape(at_place({1, 0, 0}), &half_a_floor);
         return compound;
       },
       {0, 0, -0.5}},
      {"asset in a compound",
       [] {
         auto compound = std::make_unique<btCompoundShape>();
         compound->addChildShape(at_place({0, 0, 0.1}), &block);
         return compound;
       },
       {0, 0, -0.6}},
      {"asset", [] { return std::make_unique<bullet::Shape>(cube()); }, {0, 0, -0.5}},
  };
  const Listen listen;
  for (const Ground& ground : grounds) {
    SCOPED_TRACE(ground.name);
    World world;
    world.add(ground.make(), 0, btTransform(btQuaternion({1, 0, 0}, ground.turn), ground.at));
    btRigidBody& box = world.add(cube_of_side(0.2), 1, btVector3(0.03, 0.02, 0.11));
    world.step(240);
    EXPECT_NEAR(box.getWorldTransform().getOrigin().z(), 0.1, 0.005 * 0.2);
    EXPECT_NEAR(box.getWorldTransform().getBasis()[2][2], 1, 1e-4);
    EXPECT_LT(box.getLinearVelocity().length(), 1e-3);
  }
  EXPECT_TRUE(warned.empty()) << warned[0];
}

TEST(BulletPartners, RoundOnesBearItsWeight) {
  for (const bool capsule : {false, true}) {
    World world;
    std::unique_ptr<btCollisionShape> shape;
    if (capsule) {
      shape = std::make_unique<btCapsuleShapeX>(1, 4);
    } else {
      shape = std::make_unique<btSphereShape>(1);
    }
    world.add(std::move(shape), 0, btVector3(0, 0, -1));
    btRigidBody& box = world.add(cube_of_side(0.2), 1, btVector3(0, 0, 0.11));
    box.setAngularFactor(0);
    world.step(240);
    EXPECT_NEAR(box.getWorldTransform().getOrigin().z(), 0.1, 0.02 * 0.2);
  }
}

TEST(BulletPartners, AssetsInACompoundFall) {
  World world;
  world.add_ground();
  static bullet::Shape half(cube());
  auto compound = std::make_unique<btCompoundShape>();
  compound->addChildShape(at_place({-0.5, 0, 0}), &half);
  compound->addChildShape(at_place({0.5, 0, 0}), &half);
  btRigidBody& body = world.add(std::move(compound), 5, btVector3(0, 0, 0.52));
  world.step(480);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.5, 0.005);
}

// What is no Shape though of its type is met by the functions of its own world.
TEST(BulletPartners, TwoWorldsMayShareContacts) {
  struct Counting : btDefaultCollisionConfiguration {
    int asked = 0;
    btCollisionAlgorithmCreateFunc* getCollisionAlgorithmCreateFunc(int a, int b) override {
      ++asked;
      return btDefaultCollisionConfiguration::getCollisionAlgorithmCreateFunc(a, b);
    }
  } configurations[2];
  btCollisionDispatcher one(&configurations[0]), other(&configurations[1]);
  bullet::Contacts contacts;
  contacts.register_with(one);
  contacts.register_with(other);
  struct Own : btBoxShape {
    Own() : btBoxShape(btVector3(1, 1, 1)) { m_shapeType = CUSTOM_CONCAVE_SHAPE_TYPE; }
  } own;
  btCollisionObject first, second;
  first.setCollisionShape(&own);
  second.setCollisionShape(&own);
  const btTransform at = btTransform::getIdentity();
  const btCollisionObjectWrapper a(nullptr, &own, &first, at, -1, -1),
      b(nullptr, &own, &second, at, -1, -1);
  for (Counting& configuration : configurations) configuration.asked = 0;
  btCollisionAlgorithm* const algorithm =
      one.findAlgorithm(&a, &b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  EXPECT_GT(configurations[0].asked, 0);
  EXPECT_EQ(configurations[1].asked, 0);
  algorithm->~btCollisionAlgorithm();
  one.freeCollisionAlgorithm(algorithm);
}

TEST(BulletPartners, WhatCannotBeMetIsToldOnce) {
  const Listen listen;
  World world;
  world.add(cube_of_side(1), 1, btVector3(0, 0, 0));
  world.add(cube_of_side(1), 1, btVector3(5, 0, 0));
  static btTriangleMesh mesh;
  mesh.addTriangle({-9, -9, 0}, {9, -9, 0}, {0, 9, 0});
  auto gimpact = std::make_unique<btGImpactMeshShape>(&mesh);
  gimpact->updateBound();
  world.add(std::move(gimpact), 0, btVector3(0, 0, 0));
  const btVector3 at(0, 0, 0);
  const btScalar radius = 1;
  world.add(std::make_unique<btMultiSphereShape>(&at, &radius, 1), 0, btVector3(0, 0, 0));
  world.step(5);
  ASSERT_EQ(warned.size(), 2u);
  for (const std::string& sentence : warned) {
    EXPECT_NE(sentence.find("ist::bullet::Shape"), std::string::npos);
    EXPECT_TRUE(sentence.find("GImpactMesh") != std::string::npos ||
                sentence.find("MultiSphere") != std::string::npos)
        << sentence;
  }
}

TEST(BulletShape, ScalesAllAxesAlike) {
  const Listen listen;
  bullet::Shape shape(cube());
  shape.setLocalScaling({2, 2, 2});
  btVector3 lower, upper, inertia;
  shape.getAabb(btTransform::getIdentity(), lower, upper);
  EXPECT_NEAR(upper.x(), 1, 2 * cube().protrusion() + 1e-9);
  shape.calculateLocalInertia(3, inertia);
  EXPECT_NEAR(inertia.x(), 3 * 4 / 6.0, 1e-3);
  EXPECT_NEAR(shape.volume(), 8, 1e-6);
  EXPECT_TRUE(warned.empty());
  shape.setLocalScaling({1, 2, 1});
  EXPECT_EQ(warned.size(), 1u);
  EXPECT_EQ(shape.scale(), 2);
}

TEST(BulletShape, RaysAndSweepsMeetItsSurface) {
  World world;
  world.add(cube_of_side(2), 0, btVector3(0.1, 0, 3));
  world.step(1);
  const btVector3 from(0.3, 0.2, 9), to(0.3, 0.2, -9);
  btCollisionWorld::ClosestRayResultCallback ray(from, to);
  world.world.rayTest(from, to, ray);
  ASSERT_TRUE(ray.hasHit());
  EXPECT_NEAR(ray.m_hitPointWorld.z(), 4, 1e-6);
  EXPECT_NEAR(ray.m_hitNormalWorld.z(), 1, 1e-6);
  // All of them, and neither more than its length nor those seen from behind.
  btCollisionWorld::AllHitsRayResultCallback all(from, to);
  world.world.rayTest(from, to, all);
  ASSERT_EQ(all.m_hitFractions.size(), 2);
  EXPECT_NEAR(all.m_hitPointWorld[0].z() + all.m_hitPointWorld[1].z(), 6, 1e-6);
  btCollisionWorld::AllHitsRayResultCallback fronts(from, to);
  fronts.m_flags |= btTriangleRaycastCallback::kF_FilterBackfaces;
  world.world.rayTest(from, to, fronts);
  ASSERT_EQ(fronts.m_hitFractions.size(), 1);
  EXPECT_NEAR(fronts.m_hitPointWorld[0].z(), 4, 1e-6);
  btCollisionWorld::ClosestRayResultCallback short_of_it(from, {0.3, 0.2, 4.01});
  world.world.rayTest(from, {0.3, 0.2, 4.01}, short_of_it);
  EXPECT_FALSE(short_of_it.hasHit());
  const btSphereShape ball(0.5);
  btCollisionWorld::ClosestConvexResultCallback sweep(from, to);
  world.world.convexSweepTest(&ball, at_place(from), at_place(to), sweep);
  ASSERT_TRUE(sweep.hasHit());
  EXPECT_NEAR(9 - 18 * sweep.m_closestHitFraction, 4.5, 0.02);
}

int started = 0, ended = 0, processed = 0;

TEST(BulletEvents, StartedOnceProcessedEachStepEndedOnce) {
  started = ended = processed = 0;
  gContactStartedCallback = [](btPersistentManifold* const&) { ++started; };
  gContactEndedCallback = [](btPersistentManifold* const&) { ++ended; };
  gContactProcessedCallback = [](btManifoldPoint&, void*, void*) { return ++processed > 0; };
  {
    World world;
    world.add_ground();
    btRigidBody& box = world.add(cube_of_side(1), 1, btVector3(0, 0, 0.499));
    int points = 0, least = 100;
    world.step(240, [&] {
      least = std::min(least, processed - points);
      points = processed;
    });
    EXPECT_EQ(started, 1);
    EXPECT_EQ(ended, 0);
    EXPECT_GE(least, 4);
    EXPECT_LE(processed, 8 * 240);
    box.setWorldTransform(at_place({0, 0, 0.7}));
    world.step(1);
    EXPECT_EQ(started, 1);
    EXPECT_EQ(ended, 1);
    EXPECT_EQ(processed, points);
    box.setWorldTransform(at_place({0, 0, 0.499}));
    box.setLinearVelocity({0, 0, 0});
    world.step(1);
    EXPECT_EQ(started, 2);
  }
  EXPECT_EQ(ended, 2);  // with the world
  gContactStartedCallback = nullptr;
  gContactEndedCallback = nullptr;
  gContactProcessedCallback = nullptr;
}

TEST(BulletEvents, ContactTestGetsThePoints) {
  struct Count : btCollisionWorld::ContactResultCallback {
    int points = 0;
    btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
                             const btCollisionObjectWrapper*, int, int) override {
      ++points;
      EXPECT_NEAR(point.m_positionWorldOnA.z(), 0, 0.02);
      EXPECT_NEAR(std::abs(point.m_normalWorldOnB.z()), 1, 1e-3);
      return 0;
    }
  };
  World world;
  world.add_ground();
  btRigidBody& box = world.add(cube_of_side(1), 1, btVector3(0, 0, 0.49));
  Count count;
  world.world.contactTest(&box, count);
  EXPECT_GE(count.points, 4);
}

// Bullet's convex shapes tell the nearest points too.
TEST(BulletEvents, PairTestTellsTheGapUpToItsThreshold) {
  struct Nearest : btCollisionWorld::ContactResultCallback {
    int points = 0;
    btVector3 on_a, on_b;
    btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
                             const btCollisionObjectWrapper*, int, int) override {
      ++points;
      on_a = point.getPositionWorldOnA(), on_b = point.getPositionWorldOnB();
      return 0;
    }
  };
  World world;
  btRigidBody& a = world.add(cube_of_side(1), 1, btVector3(0, 0, 0));
  btRigidBody& b = world.add(cube_of_side(1), 1, btVector3(1.05f, 0.1f, 0.2f));
  for (const bool turned : {false, true}) {
    for (const double most : {0.0, 0.04, 0.1}) {
      Nearest nearest;
      nearest.m_closestDistanceThreshold = btScalar(most);
      world.world.contactPairTest(turned ? &b : &a, turned ? &a : &b, nearest);
      ASSERT_EQ(nearest.points, most > 0.05 ? 1 : 0) << most;
      if (nearest.points == 0) continue;
      EXPECT_NEAR((turned ? nearest.on_b : nearest.on_a).x(), 0.5, 1e-6);
      EXPECT_NEAR((turned ? nearest.on_a : nearest.on_b).x(), 0.55, 1e-6);
    }
  }
}

// What cannot be asked is said, and the defaults hold the body.
TEST(BulletMaterial, SettingsThatAreNoneAreSaid) {
  using bullet::Settings;
  const std::vector<std::function<void(Settings&)>> wrong = {
      [](Settings& s) { s.patches = 0; },         [](Settings& s) { s.depth = 0; },
      [](Settings& s) { s.depth = -1; },          [](Settings& s) { s.depth = NAN; },
      [](Settings& s) { s.damping = -1; },        [](Settings& s) { s.damping = NAN; },
      [](Settings& s) { s.follow = NAN; },        [](Settings& s) { s.thickness = -1; },
      [](Settings& s) { s.push_out = INFINITY; }, [](Settings& s) { s.law.stiffness = -1; }};
  for (std::size_t i = 0; i < wrong.size(); ++i) {
    const Listen listen;
    World world;
    wrong[i](world.contacts.settings);
    world.add_ground();
    btRigidBody& box = world.add(cube_of_side(0.2), 1, btVector3(0, 0, 0.11));
    world.step(120);
    EXPECT_NEAR(box.getWorldTransform().getOrigin().z(), 0.1, 0.001) << i;
    ASSERT_EQ(warned.size(), 1u) << i;
    EXPECT_NE(warned[0].find("default settings"), std::string::npos) << warned[0];
  }
}

// A small ball sinks into a large asset until it meets spheres, which leave its faces uncovered.
TEST(BulletPartners, WhatIsSmallAgainstTheSpheresIsSaid) {
  for (const double radius : {0.5, 0.02}) {
    const Listen listen;
    World world;
    world.add(cube_of_side(1), 0, btVector3(0, 0, 0));
    world.add(std::make_unique<btSphereShape>(btScalar(radius)), 1,
              btVector3(0, 0, btScalar(0.5 + radius)));
    world.step(1);
    ASSERT_EQ(warned.size(), radius < 0.1 ? 1u : 0u) << radius;
    for (const std::string& sentence : warned)
      EXPECT_NE(sentence.find("small against"), std::string::npos) << sentence;
  }
}

TEST(BulletMaterial, OneWorldForAGramAndATon) {
  for (const bool alike : {false, true}) {
    World world;
    world.add_ground();
    const double masses[] = {0.001, 1, 100, 1000};
    btRigidBody* boxes[4];
    double sides[4];
    for (int i = 0; i < 4; ++i) {
      sides[i] = alike ? 0.2 : std::cbrt(masses[i] / 1000);
      boxes[i] =
          &world.add(cube_of_side(sides[i]), masses[i], btVector3(3 * i, 0, 0.55 * sides[i]));
    }
    world.step(480);
    for (int i = 0; i < 4; ++i) {
      EXPECT_NEAR(boxes[i]->getWorldTransform().getOrigin().z() / sides[i], 0.5, 0.005)
          << masses[i];
    }
  }
}

TEST(BulletMaterial, WithoutGravityTheStepSaysHowHard) {
  World world;
  world.world.setGravity({0, 0, 0});
  world.add_ground();
  btRigidBody& box = world.add(cube_of_side(0.2), 1, btVector3(0, 0, 0.15));
  box.setLinearVelocity({0, 0, -0.5});
  double lowest = 1;
  world.step(240, [&] { lowest = std::min(lowest, box.getWorldTransform().getOrigin().z()); });
  EXPECT_GT(lowest, 0.098);
  EXPECT_LT(box.getLinearVelocity().length(), 0.5 * std::exp(-2.0));  // as of a critical spring
}

/// The rebound height of a fall from 0.1 m, relative to that height.
double bounce(double restitution) {
  World world;
  world.add_ground();
  auto shape = cube_of_side(0.2);
  btRigidBody& box = world.add(std::move(shape), 1, btVector3(0, 0, 0.2));
  box.setRestitution(restitution);
  // The plane's is 0, and Bullet multiplies them.
  const auto before = gCalculateCombinedRestitutionCallback;
  gCalculateCombinedRestitutionCallback = [](const btCollisionObject* a,
                                             const btCollisionObject* b) {
    return std::max(a->getRestitution(), b->getRestitution());
  };
  double highest = 0;
  bool down = false;
  world.step(240, [&] {
    const double gap = box.getWorldTransform().getOrigin().z() - 0.1;
    down = down || gap < 0;
    if (down) highest = std::max(highest, gap);
  });
  gCalculateCombinedRestitutionCallback = before;
  return highest / 0.1;
}

TEST(BulletMaterial, RestitutionIsBullets) {
  EXPECT_LT(bounce(0), 0.01);
  for (const double e : {0.3, 0.5, 0.8}) EXPECT_NEAR(bounce(e), e * e, 0.05) << e;
}

/// [u] How deep 1 kg of a cube of 0.2 m rests.
double depth(const std::function<void(World&, bullet::Shape&)>& change) {
  World world;
  world.add_ground();
  auto shape = cube_of_side(0.2);
  change(world, *shape);
  btRigidBody& box = world.add(std::move(shape), 1, btVector3(0, 0, 0.1));
  world.step(480);
  return 0.1 - box.getWorldTransform().getOrigin().z();
}

TEST(BulletMaterial, AShapeAndAPairMayHaveTheirOwn) {
  const double soft = stiffness_for_depth(9.81, 0.04, 0.005);
  EXPECT_NEAR(depth([&](World&, bullet::Shape& shape) { shape.stiffness = soft; }), 0.005, 5e-4);
  EXPECT_NEAR(depth([&](World& world, bullet::Shape& shape) {
                shape.stiffness = 100 * soft;
                world.contacts.of_pair = [&](const btCollisionObject&, const btCollisionObject&,
                                             bullet::Settings& settings) {
                  settings.law.stiffness = soft;
                };
              }),
              0.005, 5e-4);
}

/// A box at rest on a slope of 0.3 rad: how far it moves in a second after a change.
double slide_after(const std::function<void(World&, btRigidBody&)>& change) {
  World world;
  world.contacts.configure(world.world);
  const btQuaternion turn({0, 1, 0}, 0.3);
  btRigidBody& slope = world.add(cube_of_side(4), 0, btTransform(turn));
  slope.setFriction(1);
  btRigidBody& box =
      world.add(cube_of_side(0.2), 1, btTransform(turn, quatRotate(turn, {0, 0, 2.1})));
  box.setFriction(1);
  world.step(240);
  const btVector3 before = box.getWorldTransform().getOrigin();
  change(world, box);
  world.step(240);
  return (box.getWorldTransform().getOrigin() - before).length();
}

// Contacts that hold are not queried again: what an engine changes counts all the same.
TEST(BulletMaterial, ChangesCountWhileABodyRests) {
  EXPECT_LT(slide_after([](World&, btRigidBody&) {}), 1e-3);
  const double free = 0.5 * 9.81 * std::sin(0.3);
  EXPECT_NEAR(slide_after([](World&, btRigidBody& box) { box.setFriction(0); }), free, 0.02 * free);
  World world;
  world.add_ground();
  btRigidBody& box = world.add(cube_of_side(0.2), 1, btVector3(0, 0, 0.1));
  world.step(240);
  world.contacts.settings.depth = 0.02;
  world.step(240);
  EXPECT_NEAR(box.getWorldTransform().getOrigin().z(), 0.1 - 0.02 * 0.2, 2e-4);
}

// As a conveyor's: for every point in every step, also where nothing moves.
TEST(BulletEvents, AddedCallbackSetsEachPointInEachStep) {
  started = 0;
  gContactAddedCallback = [](btManifoldPoint&, const btCollisionObjectWrapper*, int, int,
                             const btCollisionObjectWrapper*, int, int) { return ++started > 0; };
  World world;
  world.add_ground();
  btRigidBody& box = world.add(cube_of_side(1), 1, btVector3(0, 0, 0.499));
  box.setCollisionFlags(box.getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
  world.step(240);
  started = 0;
  world.step(240);
  EXPECT_EQ(started, 4 * 240);
  gContactAddedCallback = nullptr;
}

TEST(BulletThreads, PairsAreAnsweredOnManyAtOnce) {
  const auto heights = [](bool many) {
    World world;
    world.add(std::make_unique<bullet::Shape>(cube()), 0, btVector3(0, 0, -0.5));
    std::vector<btRigidBody*> boxes;
    for (int i = 0; i < 8; ++i) {
      boxes.push_back(&world.add(cube_of_side(0.2), 1,
                                 btVector3(0.25 * (i % 4) - 0.4, 0.4 * (i / 4) - 0.2, 0.0995)));
    }
    world.step(1);  // now there are manifolds: Debian's Bullet makes them on one thread alone
    for (btRigidBody* box : boxes) {
      box->translate({0.003, 0.002, -0.002});
    }
    btDynamicsWorld& bullet_world = world.world;
    std::vector<std::function<void()>> work;
    bullet::for_each_pair(
        bullet_world, [&](bullet::PairAlgorithm& pair, btCollisionObject& a, btCollisionObject& b) {
          work.push_back([&] {
            const btCollisionObjectWrapper one(nullptr, a.getCollisionShape(), &a,
                                               a.getWorldTransform(), -1, -1);
            const btCollisionObjectWrapper other(nullptr, b.getCollisionShape(), &b,
                                                 b.getWorldTransform(), -1, -1);
            btManifoldResult result(&one, &other);
            for (int k = 0; k < 50; ++k) {
              pair.processCollision(&one, &other, bullet_world.getDispatchInfo(), &result);
            }
          });
        });
    world.contacts.settings.follow = 0;
    std::vector<std::thread> threads;
    for (const auto& one : work) {
      if (many) {
        threads.emplace_back(one);
      } else {
        one();
      }
    }
    for (std::thread& thread : threads) thread.join();
    std::vector<double> told;
    btDispatcher& dispatcher = *bullet_world.getDispatcher();
    for (int m = 0; m < dispatcher.getNumManifolds(); ++m) {
      const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(m);
      for (int i = 0; i < manifold.getNumContacts(); ++i) {
        told.push_back(manifold.getContactPoint(i).m_distance1);
      }
    }
    return told;
  };
  const std::vector<double> alone = heights(false);
  EXPECT_GE(alone.size(), 32u);
  EXPECT_EQ(heights(true), alone);
}

}  // namespace
}  // namespace ist::testing
