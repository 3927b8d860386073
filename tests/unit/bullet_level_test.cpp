// Assets on triangle meshes and height fields of Bullet's.
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <ist/raycast.h>

#include "bullet/partner.h"
#include "support/bullet_world.h"

namespace ist::testing {
namespace {

constexpr double kSide = 0.2;

/// Bullet's mesh of a closed one.
std::unique_ptr<btTriangleMesh> mesh_of(const TriangleMesh& mesh) {
  auto out = std::make_unique<btTriangleMesh>();
  for (const auto& t : mesh.triangles) {
    out->addTriangle(bullet::to_bullet(mesh.vertices[t[0]]), bullet::to_bullet(mesh.vertices[t[1]]),
                     bullet::to_bullet(mesh.vertices[t[2]]));
  }
  return out;
}

/// An open floor at the height 0 whose front is up: 2 m wide, of cells with corners here and there.
std::unique_ptr<btTriangleMesh> floor_mesh(int cells, double wave = 0) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> draw(-0.3, 0.3);
  std::vector<btVector3> corners;
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      const bool inner = i > 0 && j > 0 && i < cells && j < cells;
      const double x = i + (inner ? draw(random) : 0), y = j + (inner ? draw(random) : 0);
      const double z = wave * std::sin(6.0 * x / cells) * std::sin(6.0 * y / cells);
      corners.push_back({btScalar(2 * x / cells - 1), btScalar(2 * y / cells - 1), btScalar(z)});
    }
  }
  auto out = std::make_unique<btTriangleMesh>();
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      const btVector3* const c = &corners[static_cast<std::size_t>(j * (cells + 1) + i)];
      out->addTriangle(c[0], c[1], c[cells + 2]);
      out->addTriangle(c[0], c[cells + 2], c[cells + 1]);
    }
  }
  return out;
}

// A closed mesh is its solid: signs and distances are those of exact queries.
TEST(BulletLevel, ClosedMeshesTellTheDistancesOfTheirSolids) {
  // A flat needle, whose tip is a fan of unlike triangles.
  TriangleMesh needle;
  needle.vertices = {{1, 0, 0}, {-1, 0.3, 0}, {-1, -0.3, 0}, {-1, 0.25, 0.05}, {-1, -0.3, 0.1}};
  needle.triangles = {{0, 1, 3}, {0, 3, 4}, {0, 4, 2}, {0, 2, 1}, {1, 2, 4}, {1, 4, 3}};
  for (const auto& [name, mesh] : {std::pair{"cube", cube_mesh()},
                                   {"torus", torus_mesh(0.7, 0.3, 12, 8)},
                                   {"needle", needle}}) {
    const Asset asset = baked(mesh, name, 100);
    const auto triangles = mesh_of(mesh);
    const btBvhTriangleMeshShape shape(triangles.get(), true);
    bullet::MeshDistance near;
    near.gather(shape, {-2, -2, -2}, {2, 2, 2}, 10);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> draw(-1.1, 1.1);
    for (int i = 0; i < 2000; ++i) {
      const Eigen::Vector3d x(draw(random), draw(random), 0.5 * draw(random));
      const SurfacePoint truth = closest_point({asset.view(), {}}, x);
      const ShapeSample told = near.at(x);
      ASSERT_NEAR(told.distance, truth.distance, 1e-9) << name << " " << x.transpose();
      ASSERT_NEAR(told.gradient.norm(), 1, 1e-9);
      EXPECT_NEAR(near.at(x + 1e-6 * told.gradient).distance, told.distance + 1e-6, 1e-8);
    }
  }
}

// Behind the front and under it, to the thickness; not beside it.
TEST(BulletLevel, AnOpenMeshIsASlab) {
  const auto triangles = floor_mesh(4);
  const btBvhTriangleMeshShape shape(triangles.get(), true);
  bullet::MeshDistance near;
  near.gather(shape, {-2, -2, -2}, {2, 2, 2}, 0.3);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> draw(-1.5, 1.5);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d x(draw(random), draw(random), 0.5 * draw(random));
    const Eigen::Vector3d out = x.cwiseAbs() - Eigen::Vector3d(1, 1, 0);
    if (std::min(std::abs(out.x()), std::abs(out.y())) < 1e-6) continue;
    const double beside = std::hypot(std::max(out.x(), 0.0), std::max(out.y(), 0.0));
    const double under = std::max({0.0, x.z(), -0.3 - x.z()});
    const double expected =
        beside + under > 0 ? std::hypot(beside, under) : std::max(x.z(), -0.3 - x.z());
    ASSERT_NEAR(near.at(x).distance, expected, 1e-6) << x.transpose();
  }
  near.gather(shape, {-0.1f, -0.1f, -0.25f}, {0.1f, 0.1f, -0.2f}, 0.3);  // a box under it
  EXPECT_NEAR(near.at({0, 0, -0.22}).distance, -0.08, 1e-6);
  // The mesh covers all that is under this box: one plane tells the distances.
  near.gather(shape, {-0.4, -0.4, -0.5}, {0.4, 0.4, 0.5}, 0.3);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d x(0.25 * draw(random), 0.25 * draw(random), 0.3 * draw(random));
    const double depth = -x.z(), expected = -std::min(depth, 0.3 - depth);
    const ShapeSample told = near.at(x);
    ASSERT_NEAR(told.distance, expected, 1e-12) << x.transpose();
    EXPECT_NEAR(told.gradient.z(), depth < 0.15 ? 1 : -1, 1e-12);
  }
}

struct Level {
  const char* name;
  std::function<std::unique_ptr<btCollisionShape>()> make;
  btVector3 at = {0, 0, 0};  // its floor is at height 0
  btQuaternion turn = btQuaternion::getIdentity();
};

TEST(BulletLevel, ACubeRestsOnEachOfThem) {
  static const auto fine = floor_mesh(20), coarse = floor_mesh(1), block = mesh_of(cube_mesh());
  static btBvhTriangleMeshShape child(fine.get(), true);
  static const auto other = floor_mesh(20);
  static btBvhTriangleMeshShape mirrored(other.get(), true);
  mirrored.setLocalScaling({1, -1, 1});
  static const std::vector<double> doubles(9, 0.25);
  static const std::vector<short> shorts(9, 25);
  static const std::vector<unsigned char> bytes(9, 25);
  const auto mesh = [](btTriangleMesh& triangles, bool quantized) {
    return [&triangles, quantized] {
      return std::make_unique<btBvhTriangleMeshShape>(&triangles, quantized);
    };
  };
  const auto scaled = [](const btVector3& scale) {
    return [scale] { return std::make_unique<btScaledBvhTriangleMeshShape>(&child, scale); };
  };
  const btQuaternion from_y({1, 0, 0}, SIMD_HALF_PI), from_x({0, 1, 0}, -SIMD_HALF_PI);
  const auto terrain = [](const auto& heights, double scale, int up, double vertical) {
    return [&heights, scale, up, vertical] {
      auto shape = std::make_unique<btHeightfieldTerrainShape>(
          3, 3, static_cast<const void*>(heights.data()), btScalar(scale), btScalar(0),
          btScalar(0.5), up,
          sizeof(heights[0]) == 8   ? PHY_DOUBLE
          : sizeof(heights[0]) == 2 ? PHY_SHORT
                                    : PHY_UCHAR,
          false);
      btVector3 scaling(2, 2, 2);
      scaling[up] = btScalar(vertical);
      shape->setLocalScaling(scaling);
      return shape;
    };
  };
  const std::vector<Level> levels = {
      {"fine mesh", mesh(*fine, true)},
      {"fine mesh, not quantized", mesh(*fine, false)},
      {"two triangles", mesh(*coarse, true)},
      {"closed mesh", mesh(*block, true), {0, 0, -0.5}},
      {"scaled mesh", scaled({2, 1, 1})},
      {"mirrored mesh", scaled({-1, 1, 1})},
      {"mirrored twice",
       [] {
         return std::make_unique<btScaledBvhTriangleMeshShape>(&mirrored, btVector3(1, -1, 1));
       }},
      {"upside down", scaled({1, 1, -1}), {0, 0, 0}, btQuaternion({1, 0, 0}, SIMD_PI)},
      {"heights of shorts", terrain(shorts, 0.01, 2, 2)},
      {"heights of bytes, y up", terrain(bytes, 0.01, 1, 2), {0, 0, 0}, from_y},
      {"heights of bytes, x up", terrain(bytes, 0.01, 0, 2), {0, 0, 0}, from_x},
      {"heights of doubles, y up", terrain(doubles, 1, 1, 2), {0, 0, 0}, from_y},
  };
  const Listen listen;
  for (const Level& level : levels) {
    SCOPED_TRACE(level.name);
    World world;
    world.add(level.make(), 0, btTransform(level.turn, level.at));
    btRigidBody& box = world.add(cube_of_side(kSide), 1, btVector3(0.03, 0.02, 0.11));
    world.step(240);
    EXPECT_NEAR(box.getWorldTransform().getOrigin().z(), kSide / 2, 0.005 * kSide);
    EXPECT_NEAR(box.getWorldTransform().getBasis()[2][2], 1, 1e-4);
    EXPECT_LT(box.getLinearVelocity().length(), 1e-3);
  }
  EXPECT_TRUE(warned.empty()) << warned[0];
}

TEST(BulletLevel, ACubeSlidesOverSides) {
  const auto triangles = floor_mesh(20);
  World world;
  world.add(std::make_unique<btBvhTriangleMeshShape>(triangles.get(), true), 0, btVector3(0, 0, 0));
  btRigidBody& box = world.add(cube_of_side(kSide), 1, btVector3(-0.7, 0.05, 0.0995));
  box.setFriction(0);
  world.step(60);
  box.setLinearVelocity({1, 0, 0});
  double lowest = 1, highest = 0, tilt = 0;
  world.step(240, [&] {
    const btTransform& at = box.getWorldTransform();
    lowest = std::min<double>(lowest, at.getOrigin().z());
    highest = std::max<double>(highest, at.getOrigin().z());
    tilt = std::max<double>(tilt, 1 - at.getBasis()[2][2]);
  });
  EXPECT_NEAR(box.getWorldTransform().getOrigin().x(), 0.3, 0.002);
  EXPECT_LT(highest - lowest, 1e-3 * kSide);
  EXPECT_LT(tilt, 1e-6);
  EXPECT_NEAR(box.getLinearVelocity().x(), 1, 0.002);
}

TEST(BulletLevel, FallsAt60HzAreStopped) {
  const auto triangles = floor_mesh(20, 0.02);
  World world;
  world.add(std::make_unique<btBvhTriangleMeshShape>(triangles.get(), true), 0, btVector3(0, 0, 0));
  std::vector<btRigidBody*> boxes;
  for (int i = 0; i < 9; ++i) {
    boxes.push_back(&world.add(
        cube_of_side(kSide), 1,
        btTransform(btQuaternion({1, 2, 3}, btScalar(i)),
                    btVector3(btScalar(0.5 * (i % 3 - 1)), btScalar(0.5 * (i / 3 - 1)), 0.3f))));
    boxes.back()->setLinearVelocity({0, 0, -2});
  }
  world.step(120, {}, 60);
  for (const btRigidBody* box : boxes) {
    EXPECT_GT(box->getWorldTransform().getOrigin().z(), 0.03);
    EXPECT_LT(box->getLinearVelocity().length(), 0.05);
  }
}

/// A cube of that side, or two side by side in a compound.
std::unique_ptr<btCollisionShape> fast_shape(double side, bool compound) {
  if (!compound) return cube_of_side(side);
  static const auto part = cube_of_side(side);
  auto both = std::make_unique<btCompoundShape>();
  for (const double x : {-0.75, 0.75})
    both->addChildShape(at_place({btScalar(x * side), 0, 0}), part.get());
  return both;
}

// A small cube at 6 m/s moves by five times its side in a step of 60 Hz.
TEST(BulletImpact, FastBodiesStopAtThinOnes) {
  static const auto triangles = floor_mesh(20);
  const std::vector<Level> levels = {
      {"plane", [] { return std::make_unique<btStaticPlaneShape>(btVector3(0, 0, 1), 0); }},
      {"plate",
       [] { return std::make_unique<btBoxShape>(btVector3(1, 1, 0.0025f)); },
       {0, 0, -0.0025f}},
      {"open mesh", [] { return std::make_unique<btBvhTriangleMeshShape>(triangles.get(), true); }},
      {"asset", [] { return std::make_unique<bullet::Shape>(cube()); }, {0, 0, -0.5}},
      {"compound",
       [] {
         static btBoxShape plate(btVector3(1, 1, 0.0025f));
         auto compound = std::make_unique<btCompoundShape>();
         compound->addChildShape(at_place({0, 0, 0.3f}), &plate);
         return compound;
       },
       {0, 0, -0.3025f}},
  };
  constexpr double kSmall = 0.02;
  for (const Level& level : levels) {
    SCOPED_TRACE(level.name);
    for (const int kind : {0, 1, 2, 3}) {
      const bool compound = kind % 2 != 0, stopped = kind < 2;
      SCOPED_TRACE(compound ? "a compound falls" : "a cube falls");
      World world;
      if (stopped) world.world.addAction(&world.contacts);
      world.add(level.make(), 0, level.at);
      btRigidBody& box =
          world.add(fast_shape(kSmall, compound), 0.1, btVector3(0.03f, 0.02f, 0.25f));
      box.setCcdMotionThreshold(0.2 * kSmall);
      box.setLinearVelocity({0, 0, -6});
      box.setAngularVelocity(compound ? btVector3(0, 0, 3) : btVector3(1, 2, 3));
      double lowest = 1;
      world.step(
          180, [&] { lowest = std::min<double>(lowest, box.getWorldTransform().getOrigin().z()); },
          60);
      if (!stopped) {
        EXPECT_LT(lowest, 0);
        continue;
      }
      EXPECT_GT(lowest, 0.4 * kSmall);
      EXPECT_NEAR(box.getWorldTransform().getOrigin().z(), 0.5 * kSmall, 0.01 * kSmall);
      EXPECT_LT(box.getLinearVelocity().length(), 0.01);
    }
  }
}

// Turning in contact, it would stop for good if no step got on.
TEST(BulletImpact, ABodyThatSpinsComesToRest) {
  World world;
  world.world.addAction(&world.contacts);
  world.add_ground();
  btRigidBody& box = world.add(cube_of_side(0.02), 0.1, btVector3(0, 0, 0.25f));
  box.setCcdMotionThreshold(0.004f);
  box.setLinearVelocity({0, 0, -10});
  box.setAngularVelocity({10, 20, 30});
  world.step(270, {}, 60);
  EXPECT_NEAR(box.getWorldTransform().getOrigin().z(), 0.01, 2e-4);
  EXPECT_LT(box.getLinearVelocity().length(), 0.01);
}

TEST(BulletImpact, TheShareOfAMotionIsTold) {
  World world;
  world.add_ground();
  btRigidBody& box = world.add(cube_of_side(kSide), 1, btVector3(0, 0, 0.5));
  world.step(1);
  const auto share = [&](double threshold, double fall) {
    box.setCcdMotionThreshold(btScalar(threshold));
    box.setWorldTransform(at_place({0, 0, 0.5}));
    box.setInterpolationWorldTransform(at_place({0, 0, btScalar(0.5 - fall)}));
    double told = -1;
    bullet::for_each_pair(
        world.world, [&](bullet::PairAlgorithm& pair, btCollisionObject& a, btCollisionObject& b) {
          told = pair.calculateTimeOfImpact(&a, &b, world.world.getDispatchInfo(), nullptr);
        });
    return told;
  };
  EXPECT_NEAR(share(0.04, 1), 0.4 + 0.01, 1e-3);  // they meet by a quarter of the threshold
  EXPECT_EQ(share(0.04, 0.3), 1);                 // they do not meet
  EXPECT_EQ(share(1.1, 1), 1);                    // too little motion
  EXPECT_EQ(share(0, 1), 1);                      // not asked for
}

// Bullet's own sweeps pass what does not push, and what its filters let pass.
TEST(BulletImpact, FastBodiesPassWhatDoesNotPush) {
  for (const bool compound : {false, true}) {
    for (const int kind : {0, 1, 2}) {
      SCOPED_TRACE(std::to_string(kind) + (compound ? ", a compound" : ", a cube"));
      World world;
      world.world.setGravity({0, 0, 0});
      world.world.addAction(&world.contacts);
      btRigidBody& wall =
          world.add(std::make_unique<btBoxShape>(btVector3(0.1f, 1, 1)), 0, btVector3(1, 0, 0));
      btRigidBody& box = world.add(fast_shape(0.02, compound), 1, btVector3(0, 0, 0));
      box.setCcdMotionThreshold(0.004f);
      box.setLinearVelocity({30, 0, 0});
      btRigidBody& silent = kind == 0 ? wall : box;
      if (kind < 2) {
        silent.setCollisionFlags(silent.getCollisionFlags() |
                                 btCollisionObject::CF_NO_CONTACT_RESPONSE);
      } else {
        box.setIgnoreCollisionCheck(&wall, true);
      }
      world.step(6, {}, 60);
      EXPECT_NEAR(box.getWorldTransform().getOrigin().x(), 3, 1e-9);
    }
  }
}

// A thin plate that a contact stops in every step turned on in slow motion: half a second after a
// fall of 10 m it had half of its energy.
TEST(BulletImpact, APlateThatIsStoppedInContactLosesItsEnergy) {
  const Asset plate = baked(box_mesh({-0.05, -0.05, -0.005}, {0.05, 0.05, 0.005}), "plate", 500);
  for (int turn = 0; turn < 12; ++turn) {
    World world;
    world.contacts.configure(world.world);
    world.world.addAction(&world.contacts);
    world.add_ground();
    const btQuaternion way(btVector3(1, btScalar(0.3 * turn), -1).normalized(),
                           btScalar(0.4 * turn));
    btRigidBody& body = world.add(std::make_unique<bullet::Shape>(plate.view()), 0.1,
                                  btTransform(way, {0, 0, 0.08f}));
    body.setCcdMotionThreshold(0.005f);
    body.setLinearVelocity({0, 0, -14});
    world.step(24, {}, 60);
    const double speed = std::max<double>(body.getLinearVelocity().length(),
                                          0.05 * body.getAngularVelocity().length());
    EXPECT_LT(speed, 2) << turn;
    EXPECT_GT(body.getWorldTransform().getOrigin().z(), 0);
  }
}

// However small the threshold: a step has two dozen looks, and no body slides slower for it.
TEST(BulletImpact, ABodyThatSlidesKeepsItsSpeed) {
  World world;
  world.contacts.configure(world.world);
  world.world.addAction(&world.contacts);
  world.add_ground();
  btRigidBody& box = world.add(cube_of_side(kSide), 1, btVector3(0, 0, 0.1f));
  box.setFriction(0);
  world.step(30, {}, 60);
  box.setCcdMotionThreshold(0.002f);
  box.setLinearVelocity({10, 0, 0});
  world.step(30, {}, 60);
  EXPECT_NEAR(box.getWorldTransform().getOrigin().x(), 5, 0.01);
}

}  // namespace
}  // namespace ist::testing
