#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "support/exact_batches.h"
#include "support/turned_solid.h"

// The GPU's batch of exact penetrations, its source run by teams of the host: of one lane, and of
// 32 that go on in an order that nobody can count on.

namespace ist::testing {
namespace {

TEST(GpuExact, AnswersAreTheCpus) {
  const std::vector<BatchPair> pairs = exact_pairs(31, 1000);
  HostBatch batch(exact_solids());
  const Differences worst =
      compare_exactly(exact_assets(), pairs, batch.run(pairs, Measure::exact));
  EXPECT_GT(worst.met, 500u);
  expect_near(worst);
}

TEST(GpuExact, AlignedAnswersAreTheCpus) {
  const std::vector<BatchPair> pairs = aligned_pairs(33, 1200);
  HostBatch batch(exact_solids());
  const Differences worst =
      compare_exactly(exact_assets(), pairs, batch.run(pairs, Measure::exact));
  EXPECT_GT(batch.exact_counters.exactly, 100u);
  EXPECT_GT(worst.met, 500u);
  EXPECT_GT(worst.flush, 10u);
  EXPECT_GT(worst.touching, worst.flush);
  expect_near(worst);
}

/// For touching parts, also the area and normal of the faces that lie on each other.
TEST(GpuExact, MatesTouchAsOnTheCpu) {
  const MatedBatch mated(32, 300);
  HostBatch batch(views_of(mated.assets));
  const Differences worst =
      compare_exactly(mated.assets, mated.pairs, batch.run(mated.pairs, Measure::exact));
  EXPECT_GT(worst.met, 200u);
  EXPECT_GT(worst.flush, 150u);
  expect_near(worst);
}

/// An edge that enters a face by 1e-9 has next to no volume, but touches no more.
TEST(GpuExact, WhatGrazesIsToldAsOnTheCpu) {
  const std::vector<BatchPair> pairs = grazing_pairs();
  HostBatch batch(exact_solids());
  const Differences worst =
      compare_exactly(exact_assets(), pairs, batch.run(pairs, Measure::exact));
  EXPECT_GT(worst.flush, 15u);
  EXPECT_GT(worst.touching, worst.flush + 60);
  EXPECT_GT(worst.met, 40u);
  expect_near(worst);
}

/// A pin in its hole has no volume except rounding, unless a needle beside it goes deep.
TEST(GpuExact, ANeedleBesideFacesIsAVolume) {
  const TriangleMesh tube = Extrusion::tube(24, 1, 0.5, 0, 1).mesh(),
                     pin = Extrusion::prism(24, 0.5, 0, 1).mesh(),
                     needle = box_mesh({0.9, 0.05, 0.4}, {1.2, 0.05 + 3e-8, 0.4 + 3e-8});
  std::vector<Asset> assets;
  for (const TriangleMesh& mesh : {tube, pin, joined(pin, needle)})
    assets.push_back(surface(mesh, "part"));
  std::vector<BatchPair> pairs(2);
  pairs[0].b = 1;
  pairs[1].b = 2;
  HostBatch batch(views_of(assets));
  const std::vector<Penetration> answers = batch.run(pairs, Measure::exact);
  expect_near(compare_exactly(assets, pairs, answers));
  EXPECT_TRUE(answers[0].touching);
  EXPECT_FALSE(answers[1].touching);
}

/// Boxes and slabs are placed in floats, which end long before the range of ratios does.
TEST(GpuExact, WhatMeetsAlongEdgesAllRoundTouches) {
  constexpr std::uint32_t kSides = 12;
  std::vector<Asset> assets;
  assets.push_back(surface(turned_solid({{5, -4}, {10, -4}, {10, 4}, {5, 4}}, kSides), "tube"));
  for (const double radius : {10.0, 10 - 1e-9})
    assets.push_back(surface(turned_solid({{radius, 0}, {12, -1}, {12, 1}}, kSides), "ring"));
  std::vector<BatchPair> pairs(2 * kSides);
  for (std::uint32_t i = 0; i < pairs.size(); ++i) {
    const double half = std::numbers::pi * (i / 2) / kSides;
    pairs[i].b = 1 + i % 2;
    pairs[i].pose_b = {{std::cos(half), 0, 0, std::sin(half)}, {0, 0, 0}};
  }
  HostBatch batch(views_of(assets));
  const std::vector<Penetration> answers = batch.run(pairs, Measure::exact);
  for (std::uint32_t i = 0; i < pairs.size(); ++i) {
    const bool touches = answers[i].touching, has_volume = answers[i].volume > 0;
    EXPECT_NE(touches, has_volume) << i;
    if (i % 2 == 0) {
      EXPECT_TRUE(touches) << i;
    }
  }
}

TEST(GpuExact, AnyRatioOfSizes) {
  std::vector<BatchPair> pairs;
  for (int power = -50; power <= 50; power += 5)
    for (BatchPair pair : exact_pairs(37, 25)) {
      // A place on the larger one's surface, or near it.
      const double scale = std::pow(10.0, power), reach = 0.9 + 0.01 * (power % 7);
      pair.scale_a = 1;
      pair.scale_b = scale;
      pair.pose_a = {{1, 0, 0, 0}, {0, 0, 0}};
      for (int k = 0; k < 3; ++k) pair.pose_b.t[k] = (k == 0 ? reach : 0.01) * std::max(1.0, scale);
      pairs.push_back(pair);
    }
  HostBatch batch(exact_solids());
  const Differences worst =
      compare_exactly(exact_assets(), pairs, batch.run(pairs, Measure::exact));
  EXPECT_GT(worst.met, 100u);
  expect_near(worst);
}

/// Copies about one middle: in place and next to it few blocks cross, turned all do, for which the
/// first two passes have no memory.
TEST(GpuExact, LargeCopiesAreAnswered) {
  std::vector<Asset> assets;
  assets.push_back(surface(icosphere_mesh(5), "ball"));
  std::vector<BatchPair> pairs(3);
  pairs[1].pose_b.t[0] = 1e-9;
  pairs[2].pose_b.q[3] = 0.1;
  HostBatch batch(views_of(assets));
  const std::vector<Penetration> answers = batch.run(pairs, Measure::exact);
  EXPECT_EQ(batch.exact_counters.listed[2], 1u);
  expect_near(compare_exactly(assets, pairs, answers));
}

/// Later rounds and passes answer pairs that do not fit into a round.
TEST(GpuExact, LittleMemoryDoesNotShow) {
  std::vector<BatchPair> pairs = exact_pairs(38, 300);
  for (const BatchPair& pair : aligned_pairs(39, 100)) pairs.push_back(pair);
  HostBatch batch(exact_solids());
  const std::vector<Penetration> expected = batch.run(pairs, Measure::exact);
  const std::uint32_t most = batch.rounds;
  EXPECT_GT(most, 5u);
  batch.mesh_capacity = 7;
  batch.mesh_chunks = 12;
  expect_same_bits(batch.run(pairs, Measure::exact), expected);
  EXPECT_GT(batch.exact_counters.listed[0], 400u);  // some more than once
  EXPECT_GT(batch.rounds, 3 * most);
  batch.most_rounds = 2;
  expect_same_bits(batch.run(pairs, Measure::exact), expected);
  EXPECT_EQ(batch.rounds, 2u);
}

/// Results must not depend on which lane does what, and when.
TEST(GpuExact, LanesOfAWarpNeedNoLuck) {
  std::vector<BatchPair> pairs = exact_pairs(34, 30);
  for (const BatchPair& pair : aligned_pairs(36, 20)) pairs.push_back(pair);
  const MatedBatch mated(36, 5);
  for (const auto& [assets, asked] : {std::pair(&exact_assets(), &std::as_const(pairs)),
                                      std::pair(&mated.assets, &mated.pairs)}) {
    HostBatch batch(views_of(*assets));
    const std::vector<Penetration> expected = batch.run(*asked, Measure::exact, 1);
    expect_near(compare_exactly(*assets, *asked, expected));
    expect_same_bits(batch.run(*asked, Measure::exact, 2), expected);
  }
}

TEST(GpuExact, WhatCannotBeAskedSaysSo) {
  std::vector<GpuSolid> solids = exact_solids();
  solids.emplace_back(batch_assets()[0].view());  // keeps no mesh
  solids.emplace_back(Shape(BallShape{1}));
  std::vector<BatchPair> pairs = exact_pairs(35, 5);
  pairs[0].b = 5;
  pairs[1].a = 0;
  pairs[1].b = 6;
  pairs[2].b = 7;
  pairs[3].pose_b.t[1] = std::nan("");
  HostBatch batch(solids);
  const std::vector<Penetration> exact = batch.run(pairs, Measure::exact);
  const std::vector<Penetration> by_spheres = batch.run(pairs, Measure::matched);
  constexpr QueryStatus kNot = QueryStatus::missing_data, kInvalid = QueryStatus::invalid_input;
  for (const auto& [i, status] : {std::pair{0, kNot}, {1, kNot}, {2, kInvalid}, {3, kInvalid}}) {
    EXPECT_EQ(exact[static_cast<std::size_t>(i)].status, status);
    EXPECT_TRUE(std::isnan(exact[static_cast<std::size_t>(i)].volume));
  }
  EXPECT_EQ(exact[4].status, QueryStatus::ok);
  // A mesh alone has no spheres to sum.
  EXPECT_EQ(by_spheres[0].status, kNot);
  EXPECT_EQ(by_spheres[1].status, kNot);
}

}  // namespace
}  // namespace ist::testing
