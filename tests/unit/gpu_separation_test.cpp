#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "query/asset/sphere_tree.h"
#include "query/base/relative_pose.h"
#include "support/host_separations.h"
#include "support/random_pairs.h"

// The GPU's batch of separations, its source run by teams of the host: of one lane, and of 32 that
// go on in an order that nobody can count on.

namespace ist::testing {
namespace {

using Eigen::Vector3d;

/// [u] The least gaps of all pairs of inner spheres and of all pairs of cover balls, in double.
struct LeastGaps {
  double spheres = std::numeric_limits<double>::infinity();
  double covers = std::numeric_limits<double>::infinity();
  Vector3d normal = Vector3d::Zero();  ///< of the first of the nearest spheres, world
};

LeastGaps least_gaps(const PlacedAsset& a, const PlacedAsset& b) {
  struct Ball {
    Vector3d centre;
    double r, cover;
  };
  const RelativePose pose = *relative_pose(a, b);
  const auto balls = [](const PlacedAsset& placed, const Similarity& map) {
    const SphereTree tree = sphere_tree(placed.asset, Measure::inner);
    std::vector<Ball> out;
    for (std::uint32_t i = 0; i < kWidth * tree.level[0].count; ++i) {
      const NodeBall ball = tree.sphere(i / kWidth, i % kWidth);
      if (ball.r <= 0) continue;
      double moved[3];
      map.apply(ball.centre, moved);
      out.push_back({Vector3d(moved[0], moved[1], moved[2]), map.scale * ball.r,
                     map.scale * static_cast<double>(tree.sphere_cover[i])});
    }
    return out;
  };
  LeastGaps least;
  const std::vector<Ball> of_b = balls(b, pose.a_from_b);
  for (const Ball& x : balls(a, Similarity::identity())) {
    for (const Ball& y : of_b) {
      const double d = (y.centre - x.centre).norm();
      if (d - x.r - y.r < least.spheres) {
        least.spheres = d - x.r - y.r;
        least.normal = pose.rotation() * (y.centre - x.centre) / d;
      }
      least.covers = std::min(least.covers, d - x.cover - y.cover);
    }
  }
  return {pose.unit_a * least.spheres, pose.unit_a * least.covers, least.normal};
}

/// Size of both solids, within a factor of two.
double size_of(const BatchPair& pair) { return 2 * (pair.scale_a + pair.scale_b); }

TEST(GpuSeparation, AnswersAreTheLeastGapsInDouble) {
  const std::vector<BatchPair> pairs = RandomPairs(21).pairs_at_all_distances(300);
  HostSeparations batch(batch_solids());
  const std::vector<Separation> answers = batch.run(pairs);
  std::size_t apart = 0, covers_apart = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto [a, b] = placed(pairs[i]);
    const LeastGaps least = least_gaps(a, b);
    const Separation& answer = answers[i];
    ASSERT_EQ(answer.status, QueryStatus::ok);
    if (least.spheres <= 0) {
      EXPECT_EQ(answer.distance, 0) << i;
      EXPECT_EQ(answer.distance_max, 0) << i;
      EXPECT_EQ(answer.distance_min, 0) << i;
      EXPECT_EQ(answer.normal, Vector3d::Zero()) << i;
      continue;
    }
    const double size = size_of(pairs[i]) + least.spheres;
    ++apart;
    covers_apart += least.covers > 0;
    EXPECT_NEAR(answer.distance, least.spheres, 1e-14 * size) << i;
    EXPECT_GE(answer.distance_max, least.spheres) << i;
    EXPECT_LE(answer.distance_max, least.spheres + 1e-13 * size) << i;
    EXPECT_LE(answer.distance_min, std::max(0.0, least.covers)) << i;
    EXPECT_GE(answer.distance_min, least.covers - 1e-13 * size) << i;
    EXPECT_NEAR(answer.normal.norm(), 1, 1e-14) << i;
    EXPECT_LE((answer.point_b - answer.point_a - answer.distance * answer.normal).norm(),
              1e-14 * size)
        << i;
  }
  EXPECT_GT(apart, 120u);
  EXPECT_LT(apart, 280u);
  EXPECT_GT(covers_apart, 80u);
}

TEST(GpuSeparation, AgreesWithSeparation) {
  const std::vector<BatchPair> pairs = RandomPairs(22).pairs_at_all_distances(2000);
  HostSeparations batch(batch_solids());
  const std::vector<Separation> answers = batch.run(pairs);
  Workspace workspace;
  double worst = 0, worst_lower = 0, worst_relative = 0;
  std::size_t apart = 0, other = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto [a, b] = placed(pairs[i]);
    const Separation cpu = separation(a, b, {}, workspace);
    const Separation& gpu = answers[i];
    ASSERT_EQ(gpu.status, cpu.status);
    ASSERT_EQ(gpu.distance == 0, cpu.distance == 0) << i;
    if (cpu.distance == 0) continue;
    ++apart;
    const double size = size_of(pairs[i]) + cpu.distance;
    // The least of all, where separation() may have taken one a rounding off.
    EXPECT_LE(gpu.distance, cpu.distance + 1e-14 * size) << i;
    EXPECT_GE(gpu.distance_min, cpu.distance_min - 1e-14 * size) << i;
    worst = std::max(worst, (cpu.distance - gpu.distance) / size);
    worst_relative = std::max(worst_relative, std::abs(gpu.distance / cpu.distance - 1));
    worst_lower = std::max(worst_lower, (gpu.distance_min - cpu.distance_min) / size);
    other += (gpu.normal - cpu.normal).norm() > 1e-6;
  }
  std::printf(
      "%zu apart; distances differ by up to %.2g of the size, %.2g of the distance; lower ends by "
      "%.2g of the size; %zu other spheres\n",
      apart, worst, worst_relative, worst_lower, other);
  EXPECT_GT(apart, 900u);
  EXPECT_LE(worst, 1e-6);
  EXPECT_LE(worst_lower, 1e-5);
}

/// A copy turned by half about z: if spheres i and j are the nearest, j and i are too, exactly; and
/// all but exactly where it is turned a hundred millionth more. Float cannot tell them apart.
TEST(GpuSeparation, OfTwinsTheNearerOrTheFirstAnswers) {
  RandomPairs random(28);
  std::vector<BatchPair> pairs;
  for (int k = 0; k < 90; ++k) {
    const double off = k % 2 == 0 ? 0 : random.uniform(-1, 1) * 1e-8;
    BatchPair pair = {
        0, 0, {}, {{off, 0, 0, 1}, {random.uniform(-5, 5), random.uniform(-5, 5), 0}}};
    pairs.push_back(pair);
  }
  HostSeparations batch(batch_solids());
  const std::vector<Separation> answers = batch.run(pairs);
  std::size_t apart = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto [a, b] = placed(pairs[i]);
    const LeastGaps least = least_gaps(a, b);
    apart += least.spheres > 0;
    const Vector3d normal = least.spheres > 0 ? least.normal : Vector3d::Zero();
    EXPECT_LE((answers[i].normal - normal).norm(), 1e-12) << i;
    EXPECT_NEAR(answers[i].distance, std::max(0.0, least.spheres), 1e-14) << i;
    EXPECT_LE(answers[i].distance_min, std::max(0.0, least.covers)) << i;
    EXPECT_GE(answers[i].distance_min, least.covers - 1e-13) << i;
  }
  EXPECT_GT(apart, 50u);
  expect_same_bits(batch.run(pairs, 1), answers);
}

/// Results must not depend on splitting, or on which team does what in which order.
TEST(GpuSeparation, SameBitsHoweverItIsSplit) {
  const std::vector<BatchPair> pairs = RandomPairs(23).pairs_at_all_distances(400);
  HostSeparations roomy(batch_solids());
  const std::vector<Separation> expected = roomy.run(pairs);
  EXPECT_GT(roomy.counters[0].tasks, 50u);
  for (const std::uint32_t capacity : {0u, 30u, 300u}) {
    HostSeparations narrow(batch_solids(), capacity);
    expect_same_bits(narrow.run(pairs), expected);
  }
}

TEST(GpuSeparation, LanesOfAWarpNeedNoLuck) {
  const std::vector<BatchPair> pairs = RandomPairs(24).pairs_at_all_distances(60);
  HostSeparations roomy(batch_solids()), narrow(batch_solids(), 7);
  const std::vector<Separation> by_one = roomy.run(pairs);
  EXPECT_GT(roomy.counters[0].tasks, 3u);
  expect_same_bits(roomy.run(pairs, 1), by_one);
  expect_same_bits(narrow.run(pairs, 2), by_one);
  expect_same_bits(narrow.run(pairs, 3, {200}), roomy.run(pairs, 0, {200}));
}

/// Pairs that a limit leaves out may be as near as the interval states.
TEST(GpuSeparation, IntervalsOfALimitHoldTheFinishedOnes) {
  const std::vector<BatchPair> pairs = RandomPairs(25).pairs_at_all_distances(300);
  const std::vector<Separation> finished = HostSeparations(batch_solids()).run(pairs);
  for (const std::uint32_t most : {1u, 3u, 20u, 100u, 200u, 400u}) {
    HostSeparations batch(batch_solids()), narrow(batch_solids(), 10);
    const std::vector<Separation> answers = batch.run(pairs, 0, {most});
    expect_same_bits(narrow.run(pairs, 0, {most}), answers);
    std::size_t stopped = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      EXPECT_LE(answers[i].node_visits, most) << i;
      if (answers[i].status == QueryStatus::ok) {
        EXPECT_EQ(answers[i].distance, finished[i].distance) << i;
        EXPECT_EQ(answers[i].distance_min, finished[i].distance_min) << i;
        continue;
      }
      ++stopped;
      EXPECT_EQ(answers[i].status, QueryStatus::budget_exhausted);
      EXPECT_LE(answers[i].distance_min, finished[i].distance_min) << i;
      EXPECT_GE(answers[i].distance, finished[i].distance) << i;
      EXPECT_GE(answers[i].distance_max, finished[i].distance_max) << i;
    }
    EXPECT_GT(stopped, most <= 100 ? 20u : 0u) << most;
  }
}

/// Far apart, far from the origin, of very unlike sizes: in double, and never endless.
TEST(GpuSeparation, ExtremePlacesAreAnsweredAsWell) {
  RandomPairs random(26);
  std::vector<BatchPair> pairs;
  for (const double far : {30.0, 1e3, 1e6, 1e9, 1e12, 1e15, 1e30}) {
    for (const double scale : {1.0, 1e-3, 1e-7, 1e5}) {
      BatchPair pair = {random.asset(), random.asset(), random.pose(1), random.pose(1), 1, scale};
      for (double& t : pair.pose_b.t) t *= far;
      pairs.push_back(pair);
      for (double& t : pair.pose_a.t) t *= far;
      pairs.push_back(pair);
    }
  }
  HostSeparations batch(batch_solids());
  const std::vector<Separation> answers = batch.run(pairs);
  EXPECT_GT(batch.counters[1].listed, pairs.size() / 2);
  Workspace workspace;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto [a, b] = placed(pairs[i]);
    const Separation cpu = separation(a, b, {}, workspace);
    ASSERT_EQ(answers[i].status, cpu.status) << i;
    EXPECT_NEAR(answers[i].distance, cpu.distance, 1e-6 * cpu.distance) << i;
    EXPECT_NEAR(answers[i].distance_max, cpu.distance_max, 1e-6 * cpu.distance_max) << i;
    // separation() takes off what float may have rounded, 12 * 2^-24 of up to twice the distance.
    EXPECT_GE(answers[i].distance_min, cpu.distance_min - 1e-14 * cpu.distance_max) << i;
    EXPECT_LE(answers[i].distance_min, cpu.distance_min + 1.5e-6 * cpu.distance_max) << i;
    EXPECT_LE(answers[i].node_visits, 2 * cpu.node_visits + 100) << i;
  }
}

TEST(GpuSeparation, InvalidPosesSpoilOnlyThemselves) {
  std::vector<BatchPair> pairs = RandomPairs(27).pairs_at_all_distances(40);
  const std::vector<Separation> sound = HostSeparations(batch_solids()).run(pairs);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  pairs[3].pose_b.t[1] = nan;
  pairs[7].pose_a.q[0] = inf;
  pairs[11].scale_b = 0;
  pairs[13].scale_a = -1;
  for (double& q : pairs[17].pose_b.q) q = 0;
  pairs[19].b = 99;
  pairs[23].scale_b = nan;
  pairs[29].pose_a.t[0] = -inf;
  const std::vector<std::size_t> bad = {3, 7, 11, 13, 17, 19, 23, 29};
  const std::vector<Separation> answers = HostSeparations(batch_solids()).run(pairs);
  std::vector<Separation> rest = answers, expected = sound;
  for (const std::size_t i : bad) {
    EXPECT_EQ(answers[i].status, QueryStatus::invalid_input) << i;
    EXPECT_TRUE(std::isnan(answers[i].distance) && std::isnan(answers[i].distance_min) &&
                std::isnan(answers[i].distance_max) && answers[i].point_a.hasNaN() &&
                answers[i].point_b.hasNaN() && answers[i].normal.hasNaN())
        << i;
    rest[i] = expected[i] = {};
  }
  expect_same_bits(rest, expected);
  EXPECT_TRUE(HostSeparations(batch_solids()).run({}).empty());
}

}  // namespace
}  // namespace ist::testing
