#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include <ist/asset_layout.h>
#include <ist/bake.h>
#include <ist/query.h>
#include <ist/types.h>

#include "support/baked.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

using Eigen::Vector3d;

std::unique_ptr<Solid> bored_box() {
  return make_difference(
      make_union(make_box({0.1, 0, 0}, {1, 0.7, 0.4}), make_torus({-0.4, 0.1, 0.4}, 0.5, 0.2)),
      make_ball({1, 0.7, 0.4}, 0.5));
}

const Asset& ball_asset() {
  static const Asset asset = bake(*make_ball({0.2, 0.1, 0}, 1), testing::of_size(2000));
  return asset;
}

void expect_sound(const std::vector<Invariant>& invariants) {
  EXPECT_GE(invariants.size(), 20u);
  for (const Invariant& one : invariants) {
    EXPECT_EQ(one.violations, 0u) << one.name << ": " << one.worst << " at " << one.where;
    EXPECT_TRUE(one.checked > 0 || one.name == "spheres disjoint") << one.name;
  }
}

TEST(BakeSolid, BakesCsgSound) {
  const auto solid = bored_box();
  const Asset asset = bake(*solid, testing::of_size(800));
  const AssetHeader& h = asset.view().header();
  EXPECT_EQ(h.sphere_count, 800u);
  EXPECT_NE(h.flags & kFlagPolygonised, 0u);
  EXPECT_GT(h.coverage, 0.7);
  EXPECT_GT(h.polygonise_error, 0);
  EXPECT_LT(h.polygonise_error, 0.25 * h.matched_tree.mean_radius);
  const double scale = std::ldexp(1.0, h.exponent);
  EXPECT_NEAR(h.volume * scale * scale * scale, solid->volume(), 2e-3 * solid->volume());
  EXPECT_LT(h.volume_error, 3e-3 * h.volume);
  expect_sound(check(asset, *solid));
}

TEST(BakeSolid, BakesABallSound) {
  expect_sound(check(ball_asset(), *make_ball({0.2, 0.1, 0}, 1)));
}

TEST(BakeSolid, SameBytesForAnyNumberOfThreads) {
  const auto solid = bored_box();
  const Asset one = bake(*solid, testing::of_size(150, 1)),
              two = bake(*solid, testing::of_size(150, 2));
  EXPECT_TRUE(
      std::equal(one.bytes().begin(), one.bytes().end(), two.bytes().begin(), two.bytes().end()));
}

TEST(BakeSolid, CellsAndSpheresTellAssetsApart) {
  const auto ball = make_ball({0, 0, 0}, 1);
  const Asset fine = bake(*ball, testing::of_size(50), {}, {.cells = 64});
  const Asset coarse = bake(*ball, testing::of_size(50), {}, {.cells = 16});
  EXPECT_EQ(fine.view().header().polygonise_cells, 64u);
  EXPECT_LT(fine.view().header().polygonise_error, 0.3 * coarse.view().header().polygonise_error);
  expect_sound(check(coarse, *ball));
  EXPECT_THROW(check(coarse, *make_ball({0, 0, 0}, 1.01)), Error);
}

/// Two balls at known distances: the gap lies in the certified interval, every time.
TEST(BakeSolid, SeparationIntervalsHoldTheExactGap) {
  Workspace scratch;
  for (const double gap : {0.001, 0.02, 0.3, 2.0})
    for (int turn = 0; turn < 3; ++turn) {
      Pose pose;
      const Vector3d offset = Vector3d(1, 0.3 * turn, -0.2 * turn).normalized() * (2 + gap);
      for (int k = 0; k < 3; ++k) pose.t[k] = offset[k];
      const Separation s =
          separation({ball_asset().view(), {}}, {ball_asset().view(), pose}, {}, scratch);
      EXPECT_LE(s.distance_min, gap);
      EXPECT_GE(s.distance_max, gap);
      EXPECT_LT(s.distance_max - s.distance_min, 0.25);
    }
}

TEST(BakeSolid, PenetrationIsTheLens) {
  Workspace scratch;
  for (const double distance : {0.5, 1.0, 1.5}) {
    Pose pose;
    pose.t[0] = 0.6 * distance;
    pose.t[2] = 0.8 * distance;
    const Penetration p =
        penetration({ball_asset().view(), {}}, {ball_asset().view(), pose}, {}, scratch);
    const double lens = std::numbers::pi * (4 + distance) * (2 - distance) * (2 - distance) / 12;
    EXPECT_NEAR(p.volume / lens, 1, 0.01) << distance;
  }
}

TEST(BakeSolid, AMeshesSolidIsBakedAsTheMesh) {
  const ClosedMesh mesh = testing::closed(testing::torus_mesh(1.0, 0.4, 40, 20), "torus");
  const Asset by_mesh = bake(mesh, testing::of_size(100)),
              by_solid = bake(*make_solid(mesh), testing::of_size(100));
  EXPECT_TRUE(std::equal(by_mesh.bytes().begin(), by_mesh.bytes().end(), by_solid.bytes().begin(),
                         by_solid.bytes().end()));
  EXPECT_THROW(check(by_mesh, *make_solid(mesh)), Error);
  EXPECT_THROW(check(by_mesh, *make_ball({0, 0, 0}, 1)), Error);
  EXPECT_THROW(check(ball_asset(), mesh), Error);
}

TEST(BakeSolid, BakesFunctions) {
  const Eigen::AlignedBox3d box(Vector3d::Constant(-1.2), Vector3d::Constant(1.2));
  // A gyroid in a ball: its slope is at most that of three products, over the wave number.
  const auto gyroid = make_function_solid(
      [](const Vector3d& x) {
        const Vector3d p = 5 * x;
        const double wave = std::sin(p.x()) * std::cos(p.y()) + std::sin(p.y()) * std::cos(p.z()) +
                            std::sin(p.z()) * std::cos(p.x());
        return std::max((std::abs(wave) - 0.8) / (5 * std::sqrt(3.0)), x.norm() - 1);
      },
      box);
  const Asset asset = bake(*gyroid, testing::of_size(300), {}, {.cells = 24});
  EXPECT_GT(asset.view().header().coverage, 0.3);
  expect_sound(check(asset, *gyroid));
  const auto ball = make_function_solid([](const Vector3d& x) { return x.norm() - 1; }, box);
  EXPECT_EQ(bake(*ball, testing::of_size(20)).view().header().volume_error > 0, true);
}

TEST(BakeSolid, RefusesFunctionsThatAreNoDistances) {
  const Eigen::AlignedBox3d box(Vector3d::Constant(-1.2), Vector3d::Constant(1.2));
  const auto refused = [&](auto function, const Eigen::AlignedBox3d& bounds, const char* why) {
    try {
      bake(*make_function_solid(function, bounds), testing::of_size(20));
      ADD_FAILURE() << "accepted: " << why;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(why), std::string::npos) << error.what();
    }
  };
  refused([](const Vector3d& x) { return 2 * x.norm() - 2; }, box,
          "not 1-Lipschitz: its slope is ");
  refused([](const Vector3d& x) { return x.x() > 0.3 ? -0.1 : 0.1; }, box,
          "not 1-Lipschitz: its slope is ");
  refused([](const Vector3d&) { return std::nan(""); }, box, "not finite");
  refused([](const Vector3d&) { return 0.01; }, box, "does not resolve it");
  refused([](const Vector3d& x) { return x.norm() - 2; }, box, "beyond its bounds");
  refused([](const Vector3d& x) { return x.norm() - 1; }, {}, "no solid");
  EXPECT_THROW(make_function_solid({}, box), Error);
}

TEST(BakeSolid, RefusesWhatCannotBeDone) {
  const auto ball = make_ball({0, 0, 0}, 1);
  PackingSettings grids = testing::of_size(50);
  grids.grid = GridMode::uniform;
  EXPECT_THROW(bake(*ball, grids), Error);
  EXPECT_THROW(bake(*ball, testing::of_size(50), [](const Progress&) { return false; }), Error);
  EXPECT_THROW(bake(*ball, testing::of_size(50), {}, {.cells = 4}), Error);
}

}  // namespace
}  // namespace ist
