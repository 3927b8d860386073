#include <gtest/gtest.h>
#include <ist/query.h>

#include "support/random_assets.h"
#include "support/reference_sum.h"

namespace ist {
namespace {

using testing::make_random_asset;
using testing::random_pose;
using testing::RandomAsset;
using testing::reference_sum;
using testing::ReferenceSum;

/// The answer against all pairs in double: 1e-5 for the volume, 1e-4 for the gradients.
void expect_sum(const Penetration& answer, const ReferenceSum& sum, double lever) {
  ASSERT_EQ(answer.status, QueryStatus::ok);
  EXPECT_NEAR(answer.volume, sum.volume, 1e-5 * sum.volume);
  EXPECT_LE(answer.volume_min, sum.volume * (1 + 1e-12));
  EXPECT_GE(answer.volume_max, sum.volume * (1 - 1e-12));
  EXPECT_LE(answer.volume_max - answer.volume_min, 1e-3 * sum.volume + 1e-7);
  const double force = sum.translation_gradient.norm() + 1e-2 * sum.force_scale;
  EXPECT_LE((answer.translation_gradient - sum.translation_gradient).norm(), 1e-4 * force);
  EXPECT_LE((answer.rotation_gradient - sum.rotation_gradient).norm(),
            1e-4 * lever * sum.force_scale);
  if (sum.volume > 0) {
    EXPECT_LE((answer.centroid - sum.centroid()).norm(), 1e-5 * lever);
  }
}

TEST(Query, MatchesTheSumOverAllPairs) {
  Workspace workspace;
  std::mt19937_64 random(1);
  for (const std::size_t n : {1u, 7u, 16u, 17u, 300u, 1000u}) {
    const Asset a = make_random_asset({n, 0.2, {}, 0}, 10);
    const Asset b = make_random_asset({n / 2 + 1, 0.05, {}, 0}, 11);
    for (const double distance : {0.0, 0.7, 1.4, 1.8, 1.95, 2.4}) {
      for (const Measure measure : {Measure::matched, Measure::inner}) {
        const PlacedTree pa{a.view(), random_pose(random, 0.3), 1.0};
        PlacedTree pb{b.view(), random_pose(random, distance), 1.0};
        QuerySettings settings;
        settings.measure = measure;
        const Penetration answer = penetration(pa, pb, settings, workspace);
        SCOPED_TRACE(::testing::Message() << n << " spheres, distance " << distance);
        expect_sum(answer, reference_sum(pa, pb, measure), 2);
      }
    }
  }
}

TEST(Query, SeparationMatchesAllPairs) {
  Workspace workspace;
  std::mt19937_64 random(2);
  for (const std::size_t n : {1u, 17u, 300u, 1000u}) {
    const Asset a = make_random_asset({n, 0.2, {}, 0}, 20);
    const Asset b = make_random_asset({n / 2 + 1, 0.05, {}, 0}, 21);
    for (const double distance : {0.0, 1.4, 1.9, 2.0, 2.4, 4.0, 1000.0}) {
      const PlacedTree pa{a.view(), random_pose(random, 0.3), 1.0};
      const PlacedTree pb{b.view(), random_pose(random, distance), 1.0};
      const Separation answer = separation(pa, pb, {}, workspace);
      const testing::ReferenceGap gap = testing::reference_gap(pa, pb);
      SCOPED_TRACE(::testing::Message() << n << " spheres, distance " << distance);
      ASSERT_EQ(answer.status, QueryStatus::ok);
      EXPECT_NEAR(answer.distance, std::max(0.0, gap.distance), 2e-6);
      EXPECT_GE(answer.distance_max, std::max(0.0, gap.distance));
      EXPECT_LE(answer.distance_min, std::max(0.0, gap.covered));
      EXPECT_GE(answer.distance_min, std::max(0.0, gap.covered) - 1e-5);
      EXPECT_LE(answer.distance_max, std::max(0.0, gap.distance) + 2e-6);
      if (gap.distance > 0) {
        EXPECT_NEAR((answer.point_b - answer.point_a).norm(), answer.distance, 1e-9);
        EXPECT_NEAR(answer.normal.dot(answer.point_b - answer.point_a), answer.distance, 1e-9);
      }
    }
  }
}

}  // namespace
}  // namespace ist
