#include <gtest/gtest.h>
#include <ist/query.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/float_traps.h"
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
  const double force = sum.force.norm() + 1e-2 * sum.force_scale;
  EXPECT_LE((answer.force - sum.force).norm(), 1e-4 * force);
  EXPECT_LE((answer.torque - sum.torque).norm(), 1e-4 * lever * sum.force_scale);
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
        const PlacedAsset pa{a.view(), random_pose(random, 0.3), 1.0};
        PlacedAsset pb{b.view(), random_pose(random, distance), 1.0};
        PenetrationSettings settings;
        settings.measure = measure;
        const Penetration answer = penetration(pa, pb, settings, workspace);
        SCOPED_TRACE(::testing::Message() << n << " spheres, distance " << distance);
        expect_sum(answer, reference_sum(pa, pb, measure), 2);
      }
    }
  }
}

TEST(Query, NoGrazingPairIsLost) {
  // A single sphere just touches each sphere of the other tree from outside: many lie on the rim of
  // their node's ball.
  Workspace workspace;
  const Asset many = make_random_asset({300, 0.2, {}, 0}, 12);
  const Asset one = make_random_asset({1, 0.2, {}, 0}, 13);
  const PlacedAsset pa{many.view(), {}, 1.0};
  PlacedAsset pb{one.view(), {}, 0.3};
  const testing::WorldSphere own = testing::world_spheres(pb, Measure::matched)[0];
  for (const double depth :
       {1e-3, 1e-2, 3e-2, 6e-2, 0.1, 0.2, 0.4}) {  // where float no longer serves
    for (const testing::WorldSphere& sphere : testing::world_spheres(pa, Measure::matched)) {
      const Eigen::Vector3d to = sphere.centre +
                                 (sphere.r + (1 - depth) * own.r) * sphere.centre.normalized() -
                                 own.centre;
      for (int k = 0; k < 3; ++k) pb.pose.t[k] = to[k];
      const double want = reference_sum(pa, pb, Measure::matched).volume;
      EXPECT_NEAR(penetration(pa, pb, {}, workspace).volume, want, 1e-5 * want);
      EXPECT_NEAR(penetration(pb, pa, {}, workspace).volume, want, 1e-5 * want);
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
      const PlacedAsset pa{a.view(), random_pose(random, 0.3), 1.0};
      const PlacedAsset pb{b.view(), random_pose(random, distance), 1.0};
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

// A penetration shows where inner spheres may share a point: only where they do there is no gap.
TEST(Query, TellsTheSeparation) {
  Workspace workspace;
  std::mt19937_64 random(3);
  int met = 0, apart = 0;
  for (const std::size_t n : {2u, 17u, 300u}) {
    const Asset a = make_random_asset({n, 0.2, {}, 0}, 22);
    const Asset b = make_random_asset({n, 0.05, {0.3, 0, 0}, 3}, 23);
    for (int i = 0; i < 600; ++i) {
      const double far = i % 3 == 0 ? 1e3 : 0;
      PlacedAsset pa{a.view(), random_pose(random, far), 1.0};
      PlacedAsset pb{b.view(), random_pose(random, 0.3), 0.11};
      if (i % 2 == 0) {
        for (int k = 0; k < 3; ++k) pb.pose.t[k] += pa.pose.t[k];
        pb.pose.t[0] += 1.0 + 0.002 * i;
      } else {  // copies, in place and moved along an axis, turned by right angles
        pb = pa;
        const double turn[4][4] = {{1, 0, 0, 0}, {1, 1, 0, 0}, {0, 0, 1, 0}, {1, 0, 0, -1}};
        std::copy_n(turn[i / 2 % 4], 4, pa.pose.q);
        std::copy_n(turn[i / 8 % 4], 4, pb.pose.q);
        pb.pose.t[i / 2 % 3] += 0.125 * (i / 32);
      }
      const PenetrationAndSeparation both = query(pa, pb, {}, workspace);
      const Separation alone = separation(pa, pb, {}, workspace);
      EXPECT_EQ(both.separation.distance, alone.distance);
      EXPECT_EQ(both.separation.distance_min, alone.distance_min);
      EXPECT_EQ(both.separation.distance_max, alone.distance_max);
      EXPECT_EQ(both.separation.point_a, alone.point_a);
      EXPECT_EQ(both.separation.normal, alone.normal);
      if (!(both.penetration.volume > 0)) continue;
      const double gap = testing::reference_gap(pa, pb).distance;
      EXPECT_EQ(both.separation.distance_max == 0, gap < 0) << gap;
      ++(gap < 0 ? met : apart);
    }
  }
  EXPECT_GT(met, 100);
  EXPECT_GT(apart, 10);
}

TEST(Query, HoldsOverScalesAndSizeRatios) {
  Workspace workspace;
  std::mt19937_64 random(5);
  const Asset a = make_random_asset({400, 0.2, {}, 0}, 30);
  const Asset b = make_random_asset({300, 0.2, {0.5, -0.3, 0.1}, 3}, 31);
  for (const double scale_a : {1.0, 1e-6, 1e6}) {
    for (const double ratio : {1.0, 0.02, 1e-2, 1e-4, 1e-6, 1e2, 1e6}) {
      // B touches A's surface region, small B near one of A's spheres.
      PlacedAsset pa{a.view(), random_pose(random, 0.4 * scale_a), scale_a};
      PlacedAsset pb{b.view(), random_pose(random, 1.0), scale_a * ratio / 8};
      const auto spheres = testing::world_spheres(pa, Measure::matched);
      const auto own = testing::world_spheres(pb, Measure::matched);
      const testing::WorldSphere& near = spheres[17];
      const Eigen::Vector3d direction =
          Eigen::Vector3d(pb.pose.t[0], pb.pose.t[1], pb.pose.t[2]).normalized();
      const Eigen::Vector3d to = near.centre + (near.r + 0.2 * own[3].r) * direction;
      for (int k = 0; k < 3; ++k) pb.pose.t[k] += to[k] - own[3].centre[k];
      SCOPED_TRACE(::testing::Message() << "scale " << scale_a << ", ratio " << ratio);
      const ReferenceSum sum = reference_sum(pa, pb, Measure::matched);
      ASSERT_GT(sum.volume, 0);
      const Penetration answer = penetration(pa, pb, {}, workspace);
      ASSERT_EQ(answer.status, QueryStatus::ok);
      EXPECT_NEAR(answer.volume, sum.volume, 1e-5 * sum.volume);
      EXPECT_LE(answer.volume_min, sum.volume);
      EXPECT_GE(answer.volume_max, sum.volume);
      EXPECT_LE((answer.force - sum.force).norm(), 1e-4 * sum.force_scale);
      const Separation gap = separation(pa, pb, {}, workspace);
      const testing::ReferenceGap want = testing::reference_gap(pa, pb);
      EXPECT_LE(gap.distance_min, std::max(0.0, want.covered) + 1e-12 * scale_a);
      EXPECT_GE(gap.distance_max, std::max(0.0, want.distance) - 1e-12 * scale_a);
    }
  }
}

TEST(Query, HoldsFarFromTheOrigin) {
  Workspace workspace;
  const Asset a = make_random_asset({300, 0.2, {1e7, -2e7, 3e7}, 0}, 40);
  const Asset b = make_random_asset({300, 0.2, {-1e7, 0, 1e7}, 0}, 41);
  const PlacedAsset pa{a.view(), {}, 1.0};
  const PlacedAsset pb{b.view(), {{1, 0, 0, 0}, {2e7 + 0.9, -2e7, 2e7}}, 1.0};
  const ReferenceSum sum = reference_sum(pa, pb, Measure::matched);
  ASSERT_GT(sum.volume, 0);
  const Penetration answer = penetration(pa, pb, {}, workspace);
  EXPECT_NEAR(answer.volume, sum.volume, 1e-5 * sum.volume);
  EXPECT_LE((answer.force - sum.force).norm(), 1e-4 * sum.force_scale);
  EXPECT_LE((answer.centroid - sum.centroid()).norm(), 1e-6 * 1e7 * 1e-2);
}

TEST(Query, IsSymmetric) {
  Workspace workspace;
  std::mt19937_64 random(6);
  const Asset a = make_random_asset({500, 0.2, {}, 0}, 50);
  const Asset b = make_random_asset({200, 0.2, {}, 0}, 51);
  for (int i = 0; i < 20; ++i) {
    const PlacedAsset pa{a.view(), random_pose(random, 0.5), 1.0};
    const PlacedAsset pb{b.view(), random_pose(random, 0.1 * i), i % 2 == 0 ? 1.0 : 0.3};
    const Penetration ab = penetration(pa, pb, {}, workspace);
    const Penetration ba = penetration(pb, pa, {}, workspace);
    const double force = reference_sum(pa, pb, Measure::matched).force_scale;
    EXPECT_NEAR(ab.volume, ba.volume, 1e-5 * ab.volume);
    // Action = reaction: the same force turned round, and torques about one point that cancel.
    EXPECT_LE((ab.force + ba.force).norm(), 1e-5 * force);
    const Eigen::Vector3d to_a(pa.pose.t[0], pa.pose.t[1], pa.pose.t[2]);
    const Eigen::Vector3d to_b(pb.pose.t[0], pb.pose.t[1], pb.pose.t[2]);
    const Eigen::Vector3d torque_on_a = ba.torque + to_a.cross(ba.force);
    const Eigen::Vector3d torque_on_b = ab.torque + to_b.cross(ab.force);
    EXPECT_LE((torque_on_a + torque_on_b).norm(), 1e-4 * force);
    const Separation sab = separation(pa, pb, {}, workspace);
    const Separation sba = separation(pb, pa, {}, workspace);
    EXPECT_NEAR(sab.distance, sba.distance, 3e-6);
  }
}

TEST(Query, IsUnchangedByACommonMotion) {
  Workspace workspace;
  std::mt19937_64 random(7);
  const Asset a = make_random_asset({500, 0.2, {}, 0}, 60);
  const Asset b = make_random_asset({500, 0.2, {}, 0}, 61);
  const auto moved = [](const Pose& motion, const Pose& pose) {
    const Eigen::Quaterniond qm(motion.q[0], motion.q[1], motion.q[2], motion.q[3]);
    const Eigen::Quaterniond q =
        qm * Eigen::Quaterniond(pose.q[0], pose.q[1], pose.q[2], pose.q[3]);
    const Eigen::Vector3d t = qm * Eigen::Vector3d(pose.t[0], pose.t[1], pose.t[2]) +
                              Eigen::Vector3d(motion.t[0], motion.t[1], motion.t[2]);
    return Pose{{q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}};
  };
  for (int i = 0; i < 10; ++i) {
    const PlacedAsset pa{a.view(), random_pose(random, 0.2), 1.0};
    const PlacedAsset pb{b.view(), random_pose(random, 1.0), 1.0};
    const Pose motion = random_pose(random, 5);
    const Eigen::Quaterniond q(motion.q[0], motion.q[1], motion.q[2], motion.q[3]);
    const Penetration here = penetration(pa, pb, {}, workspace);
    const Penetration there = penetration({a.view(), moved(motion, pa.pose), 1.0},
                                          {b.view(), moved(motion, pb.pose), 1.0}, {}, workspace);
    EXPECT_NEAR(here.volume, there.volume, 1e-6 * here.volume);
    EXPECT_LE((q * here.force - there.force).norm(), 1e-5 * here.force.norm());
    EXPECT_LE((q * here.torque - there.torque).norm(), 1e-4 * here.force.norm());
  }
}

TEST(Query, GradientsAreThoseOfTheSum) {
  // The reference against its own finite differences, to 1e-6; the library against the reference.
  std::mt19937_64 random(8);
  const Asset a = make_random_asset({200, 0.3, {}, 0}, 70);
  const Asset b = make_random_asset({200, 0.3, {0.2, 0.1, 0}, 0}, 71);
  const PlacedAsset pa{a.view(), random_pose(random, 0.1), 1.0};
  const PlacedAsset pb{b.view(), random_pose(random, 0.9), 0.7};
  const ReferenceSum sum = reference_sum(pa, pb, Measure::matched);
  ASSERT_GT(sum.volume, 0);
  const double h = 1e-6;
  for (int k = 0; k < 3; ++k) {
    const auto volume_at = [&](double shift, double angle) {
      PlacedAsset moved = pb;
      moved.pose.t[k] += shift;
      const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(k)));
      const Eigen::Quaterniond q =
          turn * Eigen::Quaterniond(pb.pose.q[0], pb.pose.q[1], pb.pose.q[2], pb.pose.q[3]);
      moved.pose.q[0] = q.w(), moved.pose.q[1] = q.x();
      moved.pose.q[2] = q.y(), moved.pose.q[3] = q.z();
      return reference_sum(pa, moved, Measure::matched).volume;
    };
    EXPECT_NEAR((volume_at(h, 0) - volume_at(-h, 0)) / (2 * h), -sum.force[k],
                1e-6 * sum.force_scale);
    EXPECT_NEAR((volume_at(0, h) - volume_at(0, -h)) / (2 * h), -sum.torque[k],
                1e-6 * sum.force_scale);
  }
  Workspace workspace;
  const Penetration answer = penetration(pa, pb, {}, workspace);
  EXPECT_LE((answer.force - sum.force).norm(), 1e-5 * sum.force_scale);
  EXPECT_LE((answer.torque - sum.torque).norm(), 1e-5 * sum.force_scale);
}

// Work of the forces and torques along a closed path, by Simpson's rule: none; and over its first
// quarter what the volume changed.
TEST(Query, EnergyIsConservedOverClosedLoops) {
  Workspace workspace;
  const Asset a = make_random_asset({300, 0.2, {}, 0}, 75);
  const Asset b = make_random_asset({200, 0.2, {0.1, 0, 0}, 0}, 76);
  const PlacedAsset pa{a.view(), {}, 1.0};
  // B on a circle that leaves A and comes back, turning about an axis askew meanwhile.
  const Eigen::Vector3d axis = Eigen::Vector3d(0.3, -0.5, 0.8).normalized();
  const auto at = [&](double phase) {
    const double turn = 2 * M_PI * phase;
    const Eigen::Quaterniond q(Eigen::AngleAxisd(turn, axis));
    return PlacedAsset{b.view(),
                       {{q.w(), q.x(), q.y(), q.z()},
                        {0.2 + 1.2 * (1 - std::cos(turn)), 0.7 * std::sin(turn), 0.1}},
                       0.8};
  };
  const auto power = [&](double phase) {  // dV / d(phase)
    const double turn = 2 * M_PI * phase;
    const Penetration here = penetration(pa, at(phase), {}, workspace);
    const Eigen::Vector3d velocity(1.2 * std::sin(turn), 0.7 * std::cos(turn), 0);
    return -2 * M_PI * (here.force.dot(velocity) + here.torque.dot(axis));
  };
  constexpr int kSteps = 16'000;  // lenses begin and end with a kink in the force's slope
  double work = 0, first_quarter = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double from = double(i) / kSteps, to = double(i + 1) / kSteps;
    work += (power(from) + 4 * power((from + to) / 2) + power(to)) / (6 * kSteps);
    if (i + 1 == kSteps / 4) first_quarter = work;
  }
  const double start = penetration(pa, at(0), {}, workspace).volume;
  const double quarter = penetration(pa, at(0.25), {}, workspace).volume;
  ASSERT_GT(start, 0.01);
  ASSERT_LT(quarter, 0.5 * start);
  EXPECT_NEAR(first_quarter, quarter - start, 1e-5 * start);
  EXPECT_NEAR(work, 0, 1e-5 * start);
}

TEST(Query, HoldsAtSpecialPoses) {
  Workspace workspace;
  const Asset a = make_random_asset({400, 0.2, {}, 0}, 80);
  const double s = std::sqrt(0.5);
  const Pose poses[] = {
      {},                                   // coincident with its copy
      {{0, 1, 0, 0}, {0, 0, 0}},            // turned by π
      {{0, s, s, 0}, {1e-7, 0, 0}},         // by π about another axis, hardly moved
      {{1.0000009, 0, 0, 0}, {0.3, 0, 0}},  // off unit length within the tolerance
      {{-1, 0, 0, 0}, {0.3, 0.1, 0}},
  };
  for (const Pose& pose : poses) {
    for (const double scale : {1.0, 0.1}) {  // the smaller one lies inside
      const PlacedAsset pa{a.view(), {}, 1.0}, pb{a.view(), pose, scale};
      const ReferenceSum sum = reference_sum(pa, pb, Measure::matched);
      const Penetration answer = penetration(pa, pb, {}, workspace);
      EXPECT_NEAR(answer.volume, sum.volume, 1e-5 * sum.volume);
      EXPECT_LE((answer.force - sum.force).norm(), 1e-4 * sum.force_scale);
      EXPECT_LE((answer.torque - sum.torque).norm(), 1e-4 * sum.force_scale);
      EXPECT_EQ(separation(pa, pb, {}, workspace).distance_min, 0);
    }
  }
}

TEST(Query, RefusesPosesThatAreNone) {
  const testing::NoFloatTraps with_nan;
  Workspace workspace;
  const Asset a = make_random_asset({20, 0.5, {}, 0}, 90);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const PlacedAsset good{a.view(), {}, 1.0};
  std::vector<PlacedAsset> bad(9, good);
  bad[0].pose.q[2] = nan;
  bad[1].pose.t[0] = nan;
  bad[2].pose.t[1] = inf;
  bad[3].pose.q[0] = 0;
  bad[4].scale = 0;
  bad[5].scale = -1;
  bad[6].scale = nan;
  bad[7].asset = AssetView();
  bad[8].pose.t[2] = 1e200;
  for (const PlacedAsset& wrong : bad) {
    for (const auto& answer :
         {query(good, wrong, {}, workspace), query(wrong, good, {}, workspace)}) {
      EXPECT_EQ(answer.penetration.status, QueryStatus::invalid_input);
      EXPECT_TRUE(std::isnan(answer.penetration.volume));
      EXPECT_TRUE(std::isnan(answer.penetration.volume_max));
      EXPECT_TRUE(answer.penetration.force.hasNaN());
      EXPECT_EQ(answer.separation.status, QueryStatus::invalid_input);
      EXPECT_TRUE(std::isnan(answer.separation.distance));
      EXPECT_TRUE(std::isnan(answer.separation.distance_max));
      EXPECT_TRUE(answer.separation.normal.hasNaN());
    }
  }
  // A quaternion of any other length means its direction.
  PlacedAsset turned = good;
  turned.pose = {{0.5, 0.5, 0.5, 0.5}, {0.2, 0, 0}};
  const Penetration expected = penetration(good, turned, {}, workspace);
  for (const double length : {1e-150, 1e-3, 2.0, 1e150}) {
    PlacedAsset longer = turned;
    for (double& q : longer.pose.q) q *= length;
    EXPECT_NEAR(penetration(good, longer, {}, workspace).volume, expected.volume,
                1e-12 * expected.volume)
        << length;
  }
  PlacedAsset far = good;
  far.pose.t[0] = 1e50;
  EXPECT_EQ(penetration(good, far, {}, workspace).volume, 0);
  const Separation gap = separation(good, far, {}, workspace);
  EXPECT_GT(gap.distance_min, 0.999e50);
  EXPECT_LE(gap.distance_min, 1e50);
  EXPECT_GE(gap.distance_max, 1e50);
  EXPECT_LT(gap.distance_max, 1.001e50);
}

}  // namespace
}  // namespace ist
