// Distances as steps of a motion (SeparationSettings::pair_id): the bits of those from scratch.

#include <gtest/gtest.h>
#include <ist/query.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "mesh/samples/samples.h"
#include "support/baked.h"
#include "support/exact_pair.h"
#include "support/random_assets.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

TriangleMesh hollow_mesh(const TriangleMesh& around, const TriangleMesh& cavity) {
  return testing::joined(around, testing::inverted(cavity));
}

class SeparationLoop : public ::testing::Test {
 protected:
  /// Steps of a motion of B, as one pair.
  void expect_same(const Asset& a, const Asset& b, double scale, int steps,
                   const std::function<Pose(int)>& at) {
    const std::uint32_t id = ++pairs_;
    for (int i = 0; i < steps; ++i) {
      const PlacedAsset placed{b.view(), at(i), scale};
      const Separation want = separation({a.view(), {}, 1}, placed, {}, scratch_);
      const Separation got = separation({a.view(), {}, 1}, placed, {.pair_id = id}, kept_);
      ASSERT_EQ(got.status, want.status) << i;
      ASSERT_EQ(got.distance, want.distance) << i;
      ASSERT_EQ(got.distance_min, want.distance_min) << i;
      ASSERT_EQ(got.distance_max, want.distance_max) << i;
      ASSERT_EQ(got.point_a, want.point_a) << i;
      ASSERT_EQ(got.point_b, want.point_b) << i;
      ASSERT_EQ(got.normal, want.normal) << i;
      visits_ += got.node_visits;
      visits_from_scratch_ += want.node_visits;
      (want.distance_max > 0 ? apart_ : meet_) += 1;
    }
  }

  Workspace kept_, scratch_;
  std::uint32_t pairs_ = 0, visits_ = 0, visits_from_scratch_ = 0;
  int apart_ = 0, meet_ = 0;
};

/// Faces slide on faces, a step of the lattice or a part of it each time; many are equally near.
TEST_F(SeparationLoop, OfAlignedSolids) {
  const TriangleMesh teeth = testing::joined(testing::box_mesh({-1, -1, -1}, {1, 1, -0.5}),
                                             testing::box_mesh({-1, -0.25, 0}, {1, 0.25, 0.5}));
  const Asset a = testing::surface(teeth),
              b = testing::surface(testing::box_mesh({-1, -1, 0}, {1, 1, 0.5}));
  const Asset ball = testing::surface(testing::icosphere_mesh(4));
  const Asset ring = testing::surface(testing::torus_mesh(1, 0.25, 64, 32));
  for (const double step : {0.25, 0.0625, 0.001}) {
    expect_same(a, b, 1, 60, [&](int i) {
      return Pose{{1, 0, 0, 0}, {step * (i % 30), 0, 0.75 + step * (i / 30)}};
    });
    expect_same(ball, ball, 1, 60, [&](int i) {
      return Pose{{1, 0, 0, 0}, {2.5 - step * i, 0, 0}};
    });
    // Coaxial: as near everywhere.
    expect_same(ring, ring, 1, 40, [&](int i) {
      const double half = step * i;
      return Pose{{std::cos(half), 0, 0, std::sin(half)}, {0, 0, 0.75 + 0.01 * step * i}};
    });
  }
  EXPECT_LT(visits_, 1.1 * visits_from_scratch_);
  EXPECT_GT(apart_, 300);
}

TEST_F(SeparationLoop, OfANutInClearance) {
  const Asset bolt = testing::surface(make_sample("bolt")),
              nut = testing::surface(make_sample("nut"));
  for (const double step : {1e-4, 1e-2})
    expect_same(bolt, nut, 1, 12, [&](int i) {
      const double turns = 0.125 + step * i, half = std::numbers::pi * turns;
      return Pose{{std::cos(half), 0, 0, std::sin(half)}, {0, 0, 8 + kThreadPitch * turns}};
    });
  EXPECT_EQ(apart_, 24);
}

/// A ball goes through a wall into the cavity and out again, by steps shorter and longer than the
/// wall; a small one comes to lie in the wall as a whole.
TEST_F(SeparationLoop, ThroughWalls) {
  const Asset hollow =
      testing::surface(hollow_mesh(testing::box_mesh({-1, -1, -1}, {1, 1, 1}),
                                   testing::box_mesh({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5})));
  const Asset ball = testing::surface(testing::icosphere_mesh(3));
  for (const double scale : {0.3, 0.1})
    for (const double step : {0.013, 0.05, 0.11, 0.23, 0.5, 1.1})
      expect_same(hollow, ball, scale, static_cast<int>(4 / step), [&](int i) {
        return Pose{{1, 0, 0, 0}, {-2 + step * i, 0.01, 0.02}};
      });
  EXPECT_GT(apart_, 100);
  EXPECT_GT(meet_, 100);
}

/// A solid turns beside another: what was beyond all that is kept comes near, again and again.
TEST_F(SeparationLoop, OfWhatRolls) {
  const Asset ball = testing::surface(testing::icosphere_mesh(4));
  const Asset ring = testing::surface(testing::torus_mesh(1, 0.25, 64, 32));
  for (const double step : {1e-3, 5e-3})
    expect_same(ball, ring, 1, 800, [&](int i) {
      const double half = 0.5 * step * i;
      return Pose{{std::cos(half), 0.6 * std::sin(half), 0.8 * std::sin(half), 0}, {2.5, 0, 0}};
    });
  EXPECT_EQ(apart_, 1600);
  EXPECT_LT(visits_, visits_from_scratch_);
}

/// Any motion of solids with spheres: small steps, larger ones, and jumps to somewhere else.
TEST_F(SeparationLoop, OfAnyMotion) {
  std::mt19937_64 random(57);
  const Asset ring = testing::baked(testing::torus_mesh(0.7, 0.25, 60, 30), "ring", 300);
  const Asset ball = testing::baked(testing::icosphere_mesh(4), "ball", 200);
  for (const double step : {1e-9, 1e-5, 1e-3, 0.02, 0.2}) {
    std::uniform_real_distribution<double> any(-step, step);
    Pose pose;
    expect_same(ring, ball, 0.6, 160, [&](int i) {
      if (i % 40 == 0) pose = testing::random_pose(random, 1.5);
      if (i % 40 == 25) pose.t[0] += 0.05;  // a jump in one motion
      for (double& t : pose.t) t += any(random);
      for (double& q : pose.q) q += 0.3 * any(random);
      return pose;
    });
  }
  EXPECT_LT(visits_, 1.1 * visits_from_scratch_);
  EXPECT_GT(apart_, 400);
}

}  // namespace
}  // namespace ist
