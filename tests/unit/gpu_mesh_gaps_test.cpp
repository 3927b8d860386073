#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "support/host_separations.h"
#include "support/mesh_gaps.h"

// The GPU's batch of distances of meshes, its source run by teams of the host: of one lane, and of
// 32 that go on in an order that nobody can count on.

namespace ist::testing {
namespace {

TEST(GpuMeshGaps, AnswersAreTheCpus) {
  const std::vector<BatchPair> pairs = mesh_gap_pairs(41, 1500);
  HostSeparations batch(exact_solids());
  const GapDifferences found = compare_gaps(exact_assets(), pairs, batch.run(pairs));
  EXPECT_EQ(batch.counters[2].listed, pairs.size());
  EXPECT_GT(found.apart, 600u);
  EXPECT_LT(found.apart, 1400u);
  EXPECT_LE(found.other_points, 5u);
}

TEST(GpuMeshGaps, AlignedAnswersAreTheCpus) {
  const std::vector<BatchPair> pairs = aligned_gap_pairs(42, 1500);
  HostSeparations batch(exact_solids());
  const GapDifferences found = compare_gaps(exact_assets(), pairs, batch.run(pairs));
  EXPECT_GT(found.apart, 300u);
  EXPECT_LT(found.apart, 1400u);
  EXPECT_LE(found.other_points, 5u);
}

/// Boxes are placed in floats, which end long before the ranges of ratios and places do.
TEST(GpuMeshGaps, AnyRatioOfSizesAndAnyPlace) {
  std::vector<BatchPair> pairs;
  for (int power = -50; power <= 50; power += 5)
    for (BatchPair pair : exact_pairs(43, 25)) {
      const double scale = std::pow(10.0, power), reach = 1.05 + 0.01 * (power % 7);
      pair.scale_a = 1;
      pair.scale_b = scale;
      pair.pose_a = {{1, 0, 0, 0}, {0, 0, 0}};
      for (int k = 0; k < 3; ++k) pair.pose_b.t[k] = (k == 0 ? reach : 0.01) * std::max(1.0, scale);
      pairs.push_back(pair);
    }
  for (const double far : {30.0, 1e3, 1e6, 1e9, 1e12, 1e30})
    for (BatchPair pair : exact_pairs(44, 25)) {
      for (double& t : pair.pose_b.t) t *= far;
      pairs.push_back(pair);
    }
  HostSeparations batch(exact_solids());
  const GapDifferences found = compare_gaps(exact_assets(), pairs, batch.run(pairs));
  EXPECT_GT(found.apart, 300u);
}

TEST(GpuMeshGaps, FartherThanAskedIsNotTold) {
  const std::vector<BatchPair> pairs = mesh_gap_pairs(45, 600);
  HostSeparations batch(exact_solids());
  for (const double most : {1e-3, 0.3, 2.0}) {
    const GapDifferences found =
        compare_gaps(exact_assets(), pairs, batch.run(pairs, 0, {0, most}), most);
    EXPECT_GT(found.farther, 100u) << most;
  }
}

/// Pairs that a limit leaves out may be as near as the interval states.
TEST(GpuMeshGaps, IntervalsOfALimitHoldTheFinishedOnes) {
  const std::vector<BatchPair> pairs = mesh_gap_pairs(46, 300);
  HostSeparations batch(exact_solids());
  const std::vector<Separation> finished = batch.run(pairs);
  for (const std::uint32_t most : {1u, 5u, 20u, 80u}) {
    const std::vector<Separation> answers = batch.run(pairs, 0, {most});
    std::size_t stopped = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      EXPECT_LE(answers[i].node_visits, most) << i;
      if (answers[i].status == QueryStatus::ok) {
        EXPECT_EQ(answers[i].distance, finished[i].distance) << i;
        continue;
      }
      ++stopped;
      EXPECT_EQ(answers[i].status, QueryStatus::budget_exhausted);
      EXPECT_LE(answers[i].distance_min, finished[i].distance) << i;
      // Among equally near pairs, it may not have reached the one that answers.
      EXPECT_GE(answers[i].distance, (1 - 1e-14) * finished[i].distance) << i;
    }
    EXPECT_GT(stopped, most <= 20 ? 20u : 0u) << most;
  }
}

/// Results must not depend on which lane does what, and when, or on the pairs of a round.
TEST(GpuMeshGaps, LanesOfAWarpNeedNoLuck) {
  std::vector<BatchPair> pairs = mesh_gap_pairs(47, 40);
  for (const BatchPair& pair : aligned_gap_pairs(48, 30)) pairs.push_back(pair);
  HostSeparations batch(exact_solids());
  const std::vector<Separation> expected = batch.run(pairs, 1);
  compare_gaps(exact_assets(), pairs, expected);
  batch.mesh_capacity = 7;
  expect_same_bits(batch.run(pairs, 2), expected);
}

TEST(GpuMeshGaps, WithoutAMeshSpheresAnswer) {
  std::vector<GpuSolid> solids = exact_solids();
  solids.emplace_back(batch_assets()[0].view());  // keeps no mesh
  solids.emplace_back(Shape(BallShape{1}));
  std::vector<BatchPair> pairs = mesh_gap_pairs(49, 6);
  pairs[0].a = 5, pairs[0].b = 1;  // a mesh with spheres
  pairs[1].a = 5, pairs[1].b = 0;  // a mesh alone
  pairs[2].b = 6;
  pairs[3].b = 7;
  pairs[4].pose_b.t[1] = std::nan("");
  for (double& t : pairs[0].pose_b.t) t = 5;
  HostSeparations batch(solids);
  const std::vector<Separation> answers = batch.run(pairs);
  EXPECT_EQ(batch.counters[0].listed + batch.counters[1].listed, 1u);
  Workspace workspace;
  const Separation cpu =
      separation(PlacedAsset{batch_assets()[0].view(), pairs[0].pose_a, pairs[0].scale_a},
                 PlacedAsset{exact_assets()[1].view(), pairs[0].pose_b, pairs[0].scale_b},
                 SeparationSettings{}, workspace);
  EXPECT_NEAR(answers[0].distance, cpu.distance, 1e-6 * cpu.distance);
  const Separation farther = batch.run(pairs, 0, {0, 1e-3})[0];
  EXPECT_EQ(farther.distance, 1e-3);
  EXPECT_TRUE(std::isinf(farther.distance_max));
  EXPECT_EQ(answers[1].status, QueryStatus::missing_data);
  EXPECT_EQ(answers[2].status, QueryStatus::missing_data);
  EXPECT_EQ(answers[3].status, QueryStatus::invalid_input);
  EXPECT_EQ(answers[4].status, QueryStatus::invalid_input);
  EXPECT_EQ(answers[5].status, QueryStatus::ok);
}

}  // namespace
}  // namespace ist::testing
