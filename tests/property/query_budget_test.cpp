#include <gtest/gtest.h>
#include <ist/query.h>

#include <algorithm>
#include <cmath>

#include "query/tree_overlap/answer.h"
#include "support/query_settings.h"
#include "support/random_assets.h"
#include "support/reference_sum.h"

namespace ist {
namespace {

using testing::make_random_asset;
using testing::random_pose;

class QueryBudget : public ::testing::Test {
 protected:
  const Asset a_ = make_random_asset({1500, 0.1, {}, 0}, 1);
  const Asset b_ = make_random_asset({700, 0.2, {}, 0}, 2);
  Workspace workspace_;
  std::mt19937_64 random_{9};

  PlacedAsset placed_a() { return {a_.view(), random_pose(random_, 0.2), 1.0}; }
  PlacedAsset placed_b(double distance) { return {b_.view(), random_pose(random_, distance), 0.8}; }
};

/// [u³] Of the smaller solid's matched spheres.
double smaller_volume(const PlacedAsset& a, const PlacedAsset& b) {
  const auto volume = [](const PlacedAsset& placed) {
    const AssetHeader& header = placed.asset.header();
    const double unit = std::ldexp(placed.scale, header.exponent);
    return header.matched_tree.volume_sum * unit * unit * unit;
  };
  return std::min(volume(a), volume(b));
}

/// The stopped answer's bounds contain the finished one, and its volume lies between them.
void expect_bounds(const Penetration& stopped, const Penetration& finished) {
  EXPECT_LE(stopped.volume_min, finished.volume);
  EXPECT_GE(stopped.volume_max, finished.volume);
  EXPECT_LE(stopped.volume_min, stopped.volume);
  EXPECT_GE(stopped.volume_max, stopped.volume);
  EXPECT_TRUE(stopped.force.allFinite());
  EXPECT_TRUE(stopped.torque.allFinite());
  EXPECT_TRUE(stopped.centroid.allFinite());
}

TEST_F(QueryBudget, VisitsAreKeptAndBoundsHold) {
  double last_width = 1e30, last_error = 1e30;
  for (const std::uint32_t visits : {1u, 3u, 10u, 30u, 100u, 300u, 1000u, 100'000u}) {
    double width = 0, error = 0;
    random_.seed(9);
    for (int i = 0; i < 40; ++i) {
      const PlacedAsset a = placed_a(), b = placed_b(0.05 * i);
      const Penetration finished = penetration(a, b, {}, workspace_);
      PenetrationSettings settings;
      settings.max_visits = visits;
      settings.measure = Measure::matched;
      const Penetration stopped = penetration(a, b, settings, workspace_);
      EXPECT_LE(stopped.node_visits, visits);
      EXPECT_EQ(stopped.status,
                finished.node_visits > visits ? QueryStatus::budget_exhausted : QueryStatus::ok);
      expect_bounds(stopped, finished);
      if (stopped.status != QueryStatus::ok) {
        EXPECT_LE(stopped.volume, smaller_volume(a, b) * (1 + 1e-12));
      }
      width += stopped.volume_max - stopped.volume_min;
      error += std::abs(stopped.volume - finished.volume);
    }
    // Bounds of sixteen children need not add up to less than their parent's.
    EXPECT_LE(width, 1.2 * last_width) << visits;
    EXPECT_LE(error, 1.2 * last_error) << visits;
    last_width = width;
    last_error = error;
  }
}

TEST(KeptWithin, AStoppedAnswerShrinksAsAWhole) {
  Penetration answer;
  answer.volume = 3;
  answer.volume_min = 2;
  answer.volume_max = 5;
  answer.force = {0, 0, 6};
  answer.torque = {3, 0, 0};
  EXPECT_EQ(kept_within(1, answer).volume, 3);  // finished
  answer.status = QueryStatus::budget_exhausted;
  const Penetration kept = kept_within(1, answer);
  EXPECT_EQ(kept.volume, 1);
  EXPECT_EQ(kept.volume_min, 1);
  EXPECT_EQ(kept.volume_max, 5);
  EXPECT_DOUBLE_EQ(kept.force.z(), 2);
  EXPECT_DOUBLE_EQ(kept.torque.x(), 1);
  EXPECT_EQ(kept_within(4, answer).volume, 3);
}

TEST_F(QueryBudget, TheSmallestPairsAreLeft) {
  // The more are left, the larger they are on average: bounds widen faster than their number grows.
  constexpr std::uint32_t kMany = 16;
  double one = 0, many = 0;
  int asked = 0;
  for (int i = 0; i < 40; ++i) {
    const PlacedAsset a = placed_a(), b = placed_b(0.05 * i);
    const Penetration finished = penetration(a, b, {}, workspace_);
    if (finished.node_visits < 10 * kMany) continue;
    const auto widened = [&](std::uint32_t left) {
      const Penetration stopped =
          penetration(a, b, {.max_visits = finished.node_visits - left}, workspace_);
      return (stopped.volume_max - stopped.volume_min) -
             (finished.volume_max - finished.volume_min);
    };
    one += widened(1);
    many += widened(kMany);
    ++asked;
  }
  ASSERT_GT(asked, 10);
  EXPECT_GT(many, 2 * kMany * one);
}

TEST_F(QueryBudget, AWorkspaceChangesNothingButWhenFull) {
  Workspace small(64), ample(1 << 16);
  int full = 0;
  for (int i = 0; i < 40; ++i) {
    const PlacedAsset a = placed_a(), b = placed_b(0.05 * i);
    const Penetration finished = penetration(a, b, {}, workspace_);
    const Penetration same = penetration(a, b, {}, ample);
    EXPECT_EQ(same.volume, finished.volume);
    EXPECT_EQ(same.force, finished.force);
    const Penetration cramped = penetration(a, b, {}, small);
    expect_bounds(cramped, finished);
    if (cramped.status == QueryStatus::budget_exhausted) ++full;
    if (cramped.status == QueryStatus::ok) {
      EXPECT_EQ(cramped.volume, finished.volume);
    }
  }
  EXPECT_GT(full, 0);
}

TEST_F(QueryBudget, AStoppedSeparationStillHoldsTheGap) {
  for (const std::uint32_t visits : {1u, 5u, 20u, 80u}) {
    for (int i = 0; i < 20; ++i) {
      const PlacedAsset a = placed_a(), b = placed_b(1.6 + 0.1 * i);
      const testing::ReferenceGap gap = testing::reference_gap(a, b);
      PenetrationSettings settings;
      settings.max_visits = visits;
      const Separation answer = separation(a, b, testing::for_separation(settings), workspace_);
      EXPECT_LE(answer.node_visits, visits);
      EXPECT_LE(answer.distance_min, std::max(0.0, gap.covered));
      EXPECT_GE(answer.distance_max, std::max(0.0, gap.distance));
    }
  }
}

}  // namespace
}  // namespace ist
