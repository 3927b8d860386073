#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "query/base/relative_pose.h"
#include "query/kernel/lens.h"
#include "support/host_batch.h"
#include "support/random_pairs.h"
#include "support/reference_sum.h"

// The GPU's batch of penetrations, its source run by teams of the host: of one lane, and of 32 that
// go on in an order that nobody can count on.

namespace ist::testing {
namespace {

using Eigen::Vector3d;

TEST(GpuQuery, APlaceIsThatOfTheMatricesByEigen) {
  const HostSolids solids(batch_solids());
  RandomPairs poses(1);
  for (const BatchPair& pair : poses.pairs(200)) {
    const auto [a, b] = placed(pair);
    PairPlace place;
    ASSERT_TRUE(place.place(solids.refs()[pair.a].frame, a.pose, a.scale,
                            solids.refs()[pair.b].frame, b.pose, b.scale));
    const auto world_from = [](const PlacedAsset& tree) {
      const AssetHeader& h = tree.asset.header();
      return Eigen::Affine3d(
          Eigen::Translation3d(Vector3d(tree.pose.t)) *
          Eigen::Quaterniond(tree.pose.q[0], tree.pose.q[1], tree.pose.q[2], tree.pose.q[3])
              .normalized() *
          Eigen::Scaling(tree.scale) * Eigen::Translation3d(vector(h.centre)) *
          Eigen::Scaling(std::ldexp(1.0, h.exponent)));
    };
    const auto near = [](const Vector3d& x, const Vector3d& y) {
      EXPECT_LE((x - y).norm(), 1e-12 * (1 + y.norm()));
    };
    const Eigen::Affine3d world_a = world_from(a), world_b = world_from(b);
    for (const Vec3& x : {Vec3{0, 0, 0}, Vec3{0.3, -0.7, 0.2}, Vec3{-1, 1, 0.5}}) {
      const double from[3] = {x.x, x.y, x.z};
      double to[3];
      near(vector(place.to_world(x)), world_a * vector(x));
      place.a_from_b.apply(from, to);
      near(Vector3d(to), world_a.inverse() * (world_b * vector(x)));
      place.b_from_a.apply(from, to);
      near(Vector3d(to), world_b.inverse() * (world_a * vector(x)));
    }
    near(vector(place.offset_b), world_b.translation() - Vector3d(b.pose.t));
    EXPECT_NEAR(place.a_from_b.scale * place.unit_a, std::cbrt(world_b.linear().determinant()),
                1e-13);
  }
}

/// Grazing, deep, nearly or wholly inside, of any sizes: all digits of a float.
TEST(GpuQuery, ALensIsTheCpusInDouble) {
  RandomPairs random(2);
  for (int trial = 0; trial < 20000; ++trial) {
    const double ra = std::exp(random.uniform(-12, 0)), rb = std::exp(random.uniform(-12, 0));
    const double gap = std::abs(ra - rb), span = ra + rb - gap;
    const double part = std::exp(random.uniform(-20, 0));
    const double d = trial % 3 == 0   ? ra + rb - part * span
                     : trial % 3 == 1 ? gap + part * span
                                      : random.uniform(0, 1.2 * (ra + rb));
    const double unit = std::ldexp(1.0, -std::ilogb(std::min(ra, rb)));
    float sum[gpu::kTerms] = {};
    const bool met = gpu::add_lens({{0.5, -1, 2}, ra}, {{d, 0, 0}, rb}, unit, 1e-15, sum);
    const Lens<double> cpu = lens(ra, rb, d);
    EXPECT_EQ(met, d < ra + rb);
    const double caps = cpu.cap_a + cpu.cap_b, unit2 = unit * unit, unit3 = unit2 * unit;
    // The distance itself is given to a double's rounding.
    const double share =
        2e-6 + 1e-15 * (ra + rb) /
                   std::min({span, std::abs(ra + rb - d) + 1e-300, std::abs(d - gap) + 1e-300});
    EXPECT_NEAR(sum[gpu::kCaps], unit3 * caps, share * unit3 * caps) << ra << " " << rb << " " << d;
    EXPECT_NEAR(sum[gpu::kForce], unit2 * cpu.circle / 2, share * unit2 * cpu.circle);
    EXPECT_NEAR(sum[gpu::kTorque + 1], 2 * unit3 * cpu.circle / 2, 2 * share * unit3 * cpu.circle);
    EXPECT_NEAR(sum[gpu::kTorque + 2], unit3 * cpu.circle / 2, share * unit3 * cpu.circle);
  }
}

TEST(GpuQuery, AnswersAreTheSumsInDouble) {
  RandomPairs poses(3);
  const std::vector<BatchPair> pairs = poses.pairs(400);
  double worst = 0, worst_push = 0, worst_turn = 0, worst_centre = 0;
  std::size_t met = 0;
  // Split like batches of few pairs, and of many.
  for (const auto& [measure, most_pairs] :
       {std::pair{Measure::matched, 1}, {Measure::matched, 1'000'000}, {Measure::inner, 1}}) {
    HostBatch batch(batch_solids());
    batch.cut_for(static_cast<std::size_t>(most_pairs));
    const std::vector<Penetration> answers = batch.run(pairs, measure);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const auto [a, b] = placed(pairs[i]);
      const ReferenceSum sum = reference_sum(a, b, measure);
      ASSERT_EQ(answers[i].status, QueryStatus::ok);
      if (sum.volume == 0) {
        EXPECT_EQ(answers[i].volume, 0);
        continue;
      }
      ++met;
      const double size = 2 * pairs[i].scale_b;
      worst = std::max(worst, std::abs(answers[i].volume / sum.volume - 1));
      worst_centre = std::max(worst_centre, (answers[i].centroid - sum.centroid()).norm() / size);
      // If a ball is almost inside another, the force is a small remainder.
      const double area = sum.force_scale + std::cbrt(sum.volume * sum.volume);
      worst_push = std::max(worst_push, (answers[i].force - sum.force).norm() / area);
      worst_turn = std::max(worst_turn, (answers[i].torque - sum.torque).norm() / (area * size));
    }
    std::printf(
        "%s: worst volume %.2g, push %.2g, turn %.2g, centroid %.2g; %zu met, %u "
        "split into %u\n",
        measure == Measure::inner ? "inner" : "matched", worst, worst_push, worst_turn,
        worst_centre, met, batch.counters.splits, batch.counters.tasks);
  }
  EXPECT_GT(met, 500u);
  EXPECT_LE(worst, 1e-6);
  EXPECT_LE(worst_push, 1e-6);
  EXPECT_LE(worst_turn, 1e-6);
  EXPECT_LE(worst_centre, 1e-6);
}

/// Splits early, into small tasks.
HostBatch splitting(std::uint32_t capacity = 1 << 16) {
  HostBatch batch(batch_solids(), capacity);
  batch.most_alone = 16;
  batch.task_weight = 4;
  return batch;
}

/// Results must not depend on splitting, or on which team does what in which order.
TEST(GpuQuery, SameBitsHoweverItIsSplit) {
  RandomPairs poses(4);
  const std::vector<BatchPair> pairs = poses.pairs(100);
  HostBatch roomy = splitting();
  const std::vector<Penetration> expected = roomy.run(pairs, Measure::matched);
  EXPECT_GT(roomy.counters.tasks, 20u);
  for (const std::uint32_t capacity : {0u, 30u, 300u}) {
    HostBatch narrow = splitting(capacity);
    expect_same_bits(narrow.run(pairs, Measure::matched), expected);
  }
}

/// Few are sorted, within a factor of two; many keep their order.
TEST(GpuQuery, TheLargestPairsBegin) {
  constexpr std::uint32_t kPairs = 1000;
  RandomPairs random(8);
  std::vector<std::uint32_t> meet(kPairs), list(gpu::kSizes * kPairs);
  for (std::uint32_t& m : meet) m = static_cast<std::uint32_t>(std::exp2(random.uniform(0, 8)));
  for (const std::uint32_t capacity : {kPairs, 0u}) {
    gpu::BatchCounters counters = {};
    gpu::BatchArrays batch = {};
    batch.counters = &counters;
    batch.list = list.data();
    batch.size_capacity = capacity;
    for (std::uint32_t i = 0; i < kPairs; ++i) gpu::list_pair(batch, i, meet[i], counters.listed++);
    std::vector<bool> seen(kPairs);
    std::uint32_t least = 1u << gpu::kSizes;
    for (std::uint32_t k = 0; k < kPairs; ++k) {
      const std::uint32_t pair = gpu::listed_pair(batch, k);
      ASSERT_LT(pair, kPairs);
      EXPECT_FALSE(seen[pair]);
      seen[pair] = true;
      EXPECT_TRUE(capacity > 0 ? meet[pair] < 2 * least : pair == k);
      least = std::min(least, meet[pair]);
    }
  }
}

/// All that meet, or whether any does.
TEST(GpuQuery, CountsChildrenThatMeet) {
  HostSolids solids(batch_solids());
  std::size_t some = 0, all = 0;
  for (const BatchPair& pair : RandomPairs(9).pairs(300)) {
    const gpu::SolidRef& a = solids.refs()[pair.a];
    const gpu::SolidRef& b = solids.refs()[pair.b];
    PairPlace place;
    ASSERT_TRUE(
        place.place(a.frame, pair.pose_a, pair.scale_a, b.frame, pair.pose_b, pair.scale_b));
    const auto count = [&](std::uint32_t most) {
      return gpu::children_that_meet(a.tree[0], b.tree[0], place.a_from_b, most);
    };
    const std::uint32_t meet = count(kWidth * kWidth);
    EXPECT_EQ(count(1), meet > 0 ? 1u : 0u);
    some += meet > 0 ? 1 : 0;
    all += meet;
  }
  EXPECT_GT(some, 50u);
  EXPECT_GT(all, 5 * some);
}

TEST(GpuQuery, LanesOfAWarpNeedNoLuck) {
  RandomPairs poses(5);
  const std::vector<BatchPair> pairs = poses.pairs(60);
  HostBatch alone = splitting(), roomy = splitting(), narrow = splitting(7);
  const std::vector<Penetration> by_one = alone.run(pairs, Measure::matched);
  const std::vector<Penetration> expected = roomy.run(pairs, Measure::matched, 1);
  EXPECT_GT(roomy.counters.tasks, 2u);
  expect_same_bits(roomy.run(pairs, Measure::matched, 2), expected);
  expect_same_bits(narrow.run(pairs, Measure::matched, 3), expected);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    EXPECT_NEAR(by_one[i].volume, expected[i].volume, 2e-6 * expected[i].volume);
    EXPECT_EQ(by_one[i].sphere_pairs, expected[i].sphere_pairs);
  }
}

TEST(GpuQuery, ForceAndTorqueAreTheGradientsTurned) {
  double force[3], torque[3];
  GpuPenetrations to;
  to.force = force;
  to.torque = torque;
  const WorldSums sums = {1, {0, 0, 0}, {2, -3, 5}, {-7, 11, 13}};
  gpu::write_answer(to, 0, sums, {});
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(force[k], -sums.translation_gradient[k]);
    EXPECT_EQ(torque[k], -sums.rotation_gradient[k]);
  }
  gpu::write_nothing(to, 0, QueryStatus::invalid_input);
  EXPECT_TRUE(std::isnan(force[0]) && std::isnan(force[2]) && std::isnan(torque[2]));
}

TEST(GpuQuery, InvalidPosesSpoilOnlyThemselves) {
  RandomPairs poses(6);
  std::vector<BatchPair> pairs = poses.pairs(40);
  const std::vector<Penetration> sound = HostBatch(batch_solids()).run(pairs, Measure::matched);
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
  const std::vector<Penetration> answers = HostBatch(batch_solids()).run(pairs, Measure::matched);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const bool is_bad = std::find(bad.begin(), bad.end(), i) != bad.end();
    EXPECT_EQ(answers[i].status, is_bad ? QueryStatus::invalid_input : QueryStatus::ok) << i;
    EXPECT_EQ(std::isnan(answers[i].volume) && answers[i].centroid.hasNaN() &&
                  answers[i].force.hasNaN() && answers[i].torque.hasNaN(),
              is_bad)
        << i;
    if (!is_bad) {
      EXPECT_EQ(answers[i].volume, sound[i].volume) << i;
    }
  }
  EXPECT_TRUE(HostBatch(batch_solids()).run({}, Measure::inner).empty());
}

}  // namespace
}  // namespace ist::testing
