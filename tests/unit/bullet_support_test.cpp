// Flat contacts: the corners of their support polygon, and what bodies do that stand on them.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <ist/contact_law.h>
#include <ist/pose_eigen.h>

#include "support/bullet_world.h"

namespace ist::testing {
namespace {

using Eigen::Vector3d;

constexpr double kBox = 0.2;

const AssetView& flat_box() {
  static const Asset asset = baked(box_mesh({-0.1, -0.1, -0.02}, {0.1, 0.1, 0.02}), "plate", 1000);
  static const AssetView view = asset.view();
  return view;
}

/// A table upside down: a plate with a foot at each corner above it, one solid.
const AssetView& tray() {
  static const Asset asset = [] {
    TriangleMesh mesh = box_mesh({-0.1, -0.1, 0}, {0.1, 0.1, 0.04});
    for (const double x : {-0.08, 0.08})
      for (const double y : {-0.08, 0.08})
        mesh = joined(mesh, box_mesh({x - 0.02, y - 0.02, -0.06}, {x + 0.02, y + 0.02, 0.01}));
    return baked(std::move(mesh), "tray", 2000);
  }();
  static const AssetView view = asset.view();
  return view;
}

PlacedSolid at_height(const AssetView& tree, double x, double y, double z, double turn) {
  Eigen::Isometry3d pose(Eigen::AngleAxisd(turn, Vector3d::UnitZ()));
  pose.translation() = Vector3d(x, y, z);
  return {tree, to_pose(pose)};
}

struct Sums {
  double volume = 0, area = 0;
  Vector3d force = Vector3d::Zero(), torque = Vector3d::Zero();

  explicit Sums(std::span<const ContactPatch> patches) {
    for (const ContactPatch& patch : patches) {
      volume += patch.volume;
      area += patch.area;
      force += patch.force;
      torque += patch.torque;
    }
  }
};

// Each corner lies on the rim of both faces, and none pulls.
TEST(Support, CornersOfExactContactsSumToTheWhole) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> draw(-1, 1);
  Workspace workspace;
  for (int i = 0; i < 300; ++i) {
    const double depth = 1e-5 + 1e-3 * std::abs(draw(random));
    const PlacedSolid a = at_height(flat_box(), 0, 0, 0, 0);
    const PlacedSolid b = at_height(flat_box(), 0.12 * draw(random), 0.12 * draw(random),
                                    0.04 - depth, 3 * draw(random));
    ContactPatch patches[16];
    const ContactPatches found =
        contact_points(a, b, {.measure = Measure::exact}, workspace, patches);
    const std::span corners(patches, found.count);
    const Penetration& whole = found.penetration;
    ASSERT_GE(found.count, 3u);
    for (const ContactPatch& corner : corners) {
      ASSERT_NE(corner.id >> 63, 0u) << i;
      EXPECT_GE(corner.area, 0);
      EXPECT_NEAR(corner.depth, depth, 0.02 * depth);
      EXPECT_LE(corner.point.head<2>().cwiseAbs().maxCoeff(), 0.1 + 0.1 * depth);
    }
    const Sums sums(corners);
    EXPECT_NEAR(sums.volume, whole.volume, 1e-12 * whole.volume);
    EXPECT_LE((sums.force - whole.force).norm(), 1e-12 * sums.area);
    EXPECT_LE((sums.torque - whole.torque).norm(), 1e-12 * sums.area);
  }
}

// Planes correct the blur of spheres: a plate that is 0.01 mm deep has its four corners, its area
// and its volume; one that is 0.01 mm above has none.
TEST(Support, SpheresTakeTheirDepthsFromTheFaces) {
  Workspace workspace;
  const PlacedSolid below(BoxShape{{0.15, 0.15, 0.02}}, {});
  for (const double depth : {1e-5, 2e-4, 1e-3, -1e-5}) {
    ContactPatch patches[8];
    const ContactPatches found = contact_points(
        below, at_height(flat_box(), 0.03, 0, 0.04 - depth, 0.2), {}, workspace, patches);
    if (depth < 0) {
      EXPECT_EQ(found.count, 0u);
      continue;
    }
    ASSERT_EQ(found.count, 4u) << depth;
    const Sums sums(std::span(patches, found.count));
    EXPECT_NEAR(sums.area, 0.04, 1e-9);
    EXPECT_NEAR(sums.volume, 0.04 * depth, 1e-9 * depth);
    for (const ContactPatch& corner : std::span(patches, found.count))
      EXPECT_NEAR((corner.point.head<2>() - Eigen::Vector2d(0.03, 0)).norm(), 0.1 * std::sqrt(2),
                  1e-9);
  }
}

// Four feet are one polygon, and a round body has none.
TEST(Support, FeetShareAPolygonAndBallsHaveNone) {
  static const Asset ball = baked(icosphere_mesh(3), "ball", 500);
  Workspace workspace;
  const PlacedSolid ground(HalfSpaceShape{}, {});
  ContactPatch patches[8];
  ContactPatches found =
      contact_points(ground, at_height(tray(), 0, 0, 0.06 - 1e-4, 0.7), {}, workspace, patches);
  ASSERT_EQ(found.count, 4u);
  EXPECT_NEAR(Sums(std::span(patches, 4)).area, 4 * 0.04 * 0.04, 1e-9);
  for (const ContactPatch& corner : std::span(patches, 4))
    EXPECT_NEAR(corner.point.head<2>().norm(), 0.1 * std::sqrt(2), 1e-9);
  found = contact_points(ground, at_height(ball.view(), 0, 0, 0.99, 0.7), {}, workspace, patches);
  ASSERT_GT(found.count, 0u);
  for (const ContactPatch& patch : std::span(patches, found.count)) EXPECT_EQ(patch.id >> 63, 0u);
}

// A ball that has rolled on touches with other triangles, and its patch has another name: what it
// bore is where the solver begins.
TEST(BulletSupport, APatchThatGetsAnotherNameKeepsItsImpulse) {
  static const Asset ball = baked(icosphere_mesh(3), "ball", 500);
  World world;
  world.add(cube_of_side(4), 0, btVector3(0, 0, -2));
  btRigidBody& body =
      world.add(std::make_unique<bullet::Shape>(ball.view()), 1, btVector3(0, 0, 0.99));
  body.setAngularFactor(0);
  world.step(480);
  const auto borne = [&](std::uint64_t& name) {
    double sum = 0;
    for (int m = 0; m < world.world.getDispatcher()->getNumManifolds(); ++m) {
      const auto& manifold = *world.world.getDispatcher()->getManifoldByIndexInternal(m);
      for (int i = 0; i < manifold.getNumContacts(); ++i) {
        const btManifoldPoint& point = manifold.getContactPoint(i);
        sum += point.m_appliedImpulse;
        name = static_cast<std::uint64_t>(point.m_partId0) << 32 |
               static_cast<std::uint32_t>(point.m_index0);
      }
    }
    return sum;
  };
  std::uint64_t name = 0, other = 0;
  const double before = borne(name), weight = 9.81 / 240;
  ASSERT_NEAR(before, weight, 1e-3 * weight);
  btTransform rolled = body.getWorldTransform();
  rolled.setRotation(btQuaternion({1, 0.3, 0}, 0.5));
  body.setWorldTransform(rolled);
  world.world.performDiscreteCollisionDetection();
  EXPECT_GE(borne(other), 0.4 * weight);
  EXPECT_NE(name, other);
}

/// Whether a box that lies over a table's edge by a share of its side is there after 3 s.
bool stands(std::unique_ptr<btCollisionShape> table, const btVector3& at, double over,
            double depth = bullet::Settings().depth) {
  World world;
  world.contacts.configure(world.world);
  world.contacts.settings.depth = depth;
  world.add(std::move(table), 0, at);
  btRigidBody& box =
      world.add(cube_of_side(kBox), 1, btVector3(kBox * over, 0.01, kBox / 2 + 0.0002));
  world.step(720);
  return box.getWorldTransform().getOrigin().z() > 0.4 * kBox;
}

TEST(BulletSupport, ABoxStandsOverAnEdgeAsFarAsItsMiddle) {
  const auto hull = [] {
    auto shape = std::make_unique<btConvexHullShape>();
    for (const double x : {-0.1, 0.1})
      for (const double y : {-0.1, 0.1})
        for (const double z : {-0.1, 0.1}) shape->addPoint({x, y, z});
    return shape;
  };
  const auto triangles = [] {
    static btTriangleMesh mesh;
    if (mesh.getNumTriangles() == 0) {
      mesh.addTriangle({-0.1, -0.1, 0}, {0.1, -0.1, 0}, {0.1, 0.1, 0});
      mesh.addTriangle({-0.1, -0.1, 0}, {0.1, 0.1, 0}, {-0.1, 0.1, 0});
    }
    return std::make_unique<btBvhTriangleMeshShape>(&mesh, true);
  };
  const btVector3 under(0, 0, -0.1);
  // Spheres that reach over an edge push aslant: at 0.425 a step by patches of them threw the box
  // off hulls and triangles, at 0.475 off boxes.
  for (const double over : {0.3, 0.42, 0.425, 0.47, 0.475}) {
    EXPECT_TRUE(stands(std::make_unique<btBoxShape>(btVector3(0.1, 0.1, 0.1)), under, over))
        << over;
    EXPECT_TRUE(stands(cube_of_side(kBox), under, over)) << over;
    EXPECT_TRUE(stands(hull(), under, over)) << over;
    EXPECT_TRUE(stands(triangles(), {0, 0, 0}, over)) << over;
  }
  EXPECT_FALSE(stands(std::make_unique<btBoxShape>(btVector3(0.1, 0.1, 0.1)), under, 0.51));
  EXPECT_FALSE(stands(cube_of_side(kBox), under, 0.51));
  // It tilts as it settles into its springs: the stiffer they are, the nearer to 0.5.
  EXPECT_TRUE(stands(cube_of_side(kBox), under, 0.49, 1e-4));
}

TEST(BulletSupport, AStackThatStandsAskewDoesNotCreep) {
  for (const double hz : {60, 240}) {
    World world;
    world.contacts.configure(world.world);
    world.add_ground();
    std::vector<btRigidBody*> boxes;
    for (int i = 0; i < 10; ++i) {
      const btQuaternion turn({0, 0, 1}, 0.02 * (i * 5 % 7 - 3));
      boxes.push_back(&world.add(
          cube_of_side(kBox), 5,
          btTransform(turn, {0.002 * (i * 7 % 5 - 2), 0.002 * (i * 3 % 5 - 2), kBox * (i + 0.5)})));
    }
    const auto places = [&] {
      std::vector<btVector3> all;
      for (const btRigidBody* box : boxes) all.push_back(box->getWorldTransform().getOrigin());
      return all;
    };
    world.step(static_cast<int>(2 * hz), {}, hz);
    const std::vector<btVector3> before = places();
    world.step(static_cast<int>(10 * hz), {}, hz);
    const std::vector<btVector3> after = places();
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      EXPECT_LT((after[i] - before[i]).length(), 0.01 * kBox) << i << " at " << hz << " Hz";
      EXPECT_NEAR(after[i].z(), kBox * (double(i) + 0.5), 0.03 * kBox);
    }
  }
}

TEST(BulletSupport, ATowerOfConcavePartsStands) {
  for (const double hz : {60, 240}) {
    World world;
    world.contacts.configure(world.world);
    world.add_ground();
    const Eigen::Isometry3d in_mesh = bullet::body_frame(tray()).in_mesh;
    std::vector<btRigidBody*> parts;
    for (int i = 0; i < 10; ++i) {
      Eigen::Isometry3d mesh(Eigen::AngleAxisd(0.01 * (i % 3), Vector3d::UnitZ()));
      mesh.translation() = Vector3d(0.001 * (i % 2), 0, 0.06 + 0.1 * i);
      parts.push_back(&world.add(std::make_unique<bullet::Shape>(tray()), 1,
                                 bullet::to_bullet(Eigen::Isometry3d(mesh * in_mesh))));
    }
    const btVector3 top = parts.back()->getWorldTransform().getOrigin();
    world.step(static_cast<int>(10 * hz), {}, hz);
    EXPECT_LT((parts.back()->getWorldTransform().getOrigin() - top).length(), 0.01) << hz;
  }
}

}  // namespace
}  // namespace ist::testing
