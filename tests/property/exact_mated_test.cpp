#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <numbers>
#include <random>

#include "support/mate_checks.h"
#include "support/turned_solid.h"
#include "support/turns.h"

// Exact queries of random mates, whose volumes and contact areas follow from plane geometry. The
// soak has a million of them.

namespace ist {
namespace {

TEST(ExactMated, RandomMates) {
  testing::MateChecks checks(1);
  for (int i = 0; i < 1500; ++i) checks.run(i % 8 == 0 ? 60 : 12);
  const testing::MateTally& tally = checks.tally();
  EXPECT_GE(tally.queries, 10'000u);
  EXPECT_GE(tally.touching, 1000u);
  for (const auto& [what, count] : tally.wrong) EXPECT_EQ(count, 0u) << what;
  const testing::MateWork work = checks.work();
  EXPECT_LE(work.worst, 10) << work.what;
}

// A kernel rounds the corners of a face, and the planes of its slivers turn with them by far more.
TEST(ExactMated, FacesOfRoundedCornersLieOnEachOther) {
  std::mt19937_64 random(4);
  Workspace workspace;
  for (int i = 0; i < 200; ++i) {
    const auto corners = static_cast<std::uint32_t>(20 + i % 60);
    const testing::Extrusion fan = testing::Extrusion::prism(corners, 1, -0.5, 0);
    const testing::Extrusion box = testing::Extrusion::rectangle(0.5, 0.3, 0.4);
    TriangleMesh rounded = fan.mesh();
    for (Eigen::Vector3d& v : rounded.vertices)
      v.z() += std::uniform_real_distribution<double>(-4e-15, 4e-15)(random);
    const Asset a = testing::surface(std::move(rounded), "fan"),
                b = testing::surface(box.mesh(), "box");
    const Pose above = {{1, 0, 0, 0}, {0.2, 0.1, 0.2}};
    for (const bool exchanged : {false, true}) {
      const PlacedAsset first = {a.view(), {}, 1}, second = {b.view(), above, 1};
      const Penetration p = exchanged ? testing::exactly(second, first, workspace)
                                      : testing::exactly(first, second, workspace);
      EXPECT_TRUE(p.touching) << corners;
      EXPECT_NEAR(p.contact_area, 0.15, 1e-9) << corners << " corners, exchanged " << exchanged;
    }
  }
}

// Between surfaces that meet along edges on all sides no direction keeps them apart: sums of
// crossings remain, which are rounding.
TEST(ExactMated, WhatMeetsAlongEdgesAllRoundTouches) {
  Workspace workspace;
  for (const std::uint32_t sides : {6u, 8u, 12u, 24u}) {
    const auto ring = [&](double radius) {
      return testing::surface(testing::turned_solid({{radius, 0}, {12, -1}, {12, 1}}, sides),
                              "ring");
    };
    const Asset a = testing::surface(
        testing::turned_solid({{5, -4}, {10, -4}, {10, 4}, {5, 4}}, sides), "tube");
    const Asset on = ring(10), above = ring(10 + 1e-9), just_in = ring(10 - 1e-9),
                in = ring(10 - 1e-5);
    for (std::uint32_t k = 0; k < 3 * sides; ++k) {
      SCOPED_TRACE(std::to_string(sides) + " sides, turned by " + std::to_string(k / 3));
      const double half = std::numbers::pi * (k / 3) / sides;
      const Pose pose = {{std::cos(half), 0, 0, std::sin(half)}, {0, 0, k % 3 * 1e-15}};
      for (const bool exchanged : {false, true}) {
        const auto ask = [&](const Asset& b) {
          const PlacedAsset first = {a.view(), {}, 1}, second = {b.view(), pose, 1};
          return exchanged ? testing::exactly(second, first, workspace)
                           : testing::exactly(first, second, workspace);
        };
        const Penetration p = ask(on);
        EXPECT_EQ(p.volume, 0);
        EXPECT_TRUE(p.touching);
        EXPECT_LT(p.contact_area, 1e-9);
        EXPECT_FALSE(ask(above).touching);
        EXPECT_EQ(ask(above).volume, 0);
        EXPECT_NE(ask(just_in).volume > 0, ask(just_in).touching);  // its volume is rounding
        EXPECT_FALSE(ask(in).touching);
        EXPECT_GT(ask(in).volume, 1e-9);
      }
    }
  }
}

// If no side of a solid's box separates them, planes separate near faces that do not touch; the
// distance of each two triangles is not computed.
TEST(ExactMated, FacesNextToEachOtherCostWhatFacesOnEachOtherDo) {
  TriangleMesh askew = testing::Extrusion::tube(500, 1, 0.8, 0, 1).mesh();
  const Eigen::Quaterniond turn = Eigen::Quaterniond(0.8, 0.4, 0.3, 0.2).normalized();
  for (Eigen::Vector3d& v : askew.vertices) v = turn * v;
  const Asset tube = testing::surface(std::move(askew), "tube");
  Workspace workspace;
  const auto seconds = [&](double z) {
    double least = 1e9;
    for (int i = 0; i < 5; ++i) {
      const Eigen::Vector3d t = turn * Eigen::Vector3d(0, 0, z);
      const PlacedAsset a = {tube.view(), {}, 1},
                        b = {tube.view(), {{1, 0, 0, 0}, {t.x(), t.y(), t.z()}}, 1};
      const std::clock_t begin = std::clock();
      const Penetration p = testing::exactly(a, b, workspace);
      least = std::min(least, double(std::clock() - begin));
      EXPECT_EQ(p.volume, 0);
      EXPECT_EQ(p.touching, z == 1);
    }
    return least;
  };
  const double on = seconds(1);
  for (const double gap : {1e-11, 1e-10, 1e-9, 1e-8, 1e-7})
    EXPECT_LT(seconds(1 + gap), 3 * on) << gap;
}

TEST(ExactMated, NothingIsSearchedWhereBoxesAreApart) {
  const Asset tube = testing::surface(testing::Extrusion::tube(50, 1, 0.8, 0, 1).mesh(), "tube");
  Workspace workspace;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> angle(0, 2 * std::numbers::pi);
  for (const Eigen::Quaterniond& turn : testing::right_angled_turns()) {
    for (const double gap : {-1e-9, 0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1.0}) {
      SCOPED_TRACE(gap);
      const double half = angle(random) / 2;
      const Pose pose = {{std::cos(half), 0, 0, std::sin(half)}, {0, 0, 1 + gap}};
      const PlacedAsset a = {tube.view(), testing::turned(turn, {}), 1},
                        b = {tube.view(), testing::turned(turn, pose), 1};
      for (const bool exchanged : {false, true}) {
        const PlacedAsset &first = exchanged ? b : a, &second = exchanged ? a : b;
        const Penetration p = testing::exactly(first, second, workspace);
        EXPECT_EQ(p.node_visits == 0, gap > 0);
        EXPECT_EQ(p.touching, gap == 0);
        EXPECT_EQ(p.volume > 0, gap < 0);
        EXPECT_LE(p.volume_max, gap > 0 ? 0 : 1);
        ContactPatch patch;
        const ContactPatches found =
            contact_patches(first, second, {.measure = Measure::exact}, workspace, {&patch, 1});
        EXPECT_EQ(found.penetration.node_visits == 0, gap > 0);
        EXPECT_EQ(found.count > 0, gap < 0);
      }
    }
  }
}

}  // namespace
}  // namespace ist
