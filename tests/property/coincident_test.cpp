#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/query.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "mesh/samples/samples.h"
#include "query/lod/level_blend.h"
#include "support/random_assets.h"
#include "support/reference_sum.h"

// Copies of one asset that all but coincide.

namespace ist {
namespace {

using Eigen::Vector3d;
using testing::make_random_asset;
using testing::reference_sum;

/// A rotation vector about the object's origin, and a shift.
Pose small_pose(const Vector3d& shift, const Vector3d& turn) {
  const double angle = turn.norm();
  const Eigen::Quaterniond q(angle > 0 ? Eigen::AngleAxisd(angle, turn / angle)
                                       : Eigen::AngleAxisd::Identity());
  return {{q.w(), q.x(), q.y(), q.z()}, {shift.x(), shift.y(), shift.z()}};
}

/// `turn` after the pose's own, about the origin of B.
Pose moved_by(const Pose& pose, const Vector3d& shift, const Vector3d& turn) {
  Pose result = small_pose(shift, turn);
  const Eigen::Quaterniond both =
      Eigen::Quaterniond(result.q[0], result.q[1], result.q[2], result.q[3]) *
      Eigen::Quaterniond(pose.q[0], pose.q[1], pose.q[2], pose.q[3]);
  result.q[0] = both.w(), result.q[1] = both.x(), result.q[2] = both.y(), result.q[3] = both.z();
  for (int k = 0; k < 3; ++k) result.t[k] += pose.t[k];
  return result;
}

class CoincidentInstances : public ::testing::Test {
 protected:
  // Off centre and of another size than its unit frame, so that no frame passes for another.
  const Asset asset_ = make_random_asset({1200, 0.3, {0.3, -0.2, 0.1}, 1, 2}, 3);
  const TreeHeader& tree_ = asset_.view().header().matched_tree;
  const double radius_ = std::ldexp(tree_.mean_radius, 1);  ///< [u]
  Workspace workspace_;

  PlacedAsset still() const { return {asset_.view(), {}, 1}; }
  PlacedAsset placed(const Pose& pose, double scale = 1) const {
    return {asset_.view(), pose, scale};
  }
  CoincidenceWeight weight(const PlacedAsset& b) const {
    return coincidence_weight(tree_.root, tree_.mean_radius, relative_pose(still(), b)->a_from_b);
  }
  /// The expected answer, over all pairs of spheres in double.
  double reference(const PlacedAsset& b) const {
    const double w = weight(b).weight;
    return (1 - w) * reference_sum(still(), b, Measure::matched, 0, 0).volume +
           w / 2 * reference_sum(still(), b, Measure::matched, 0, 1).volume +
           w / 2 * reference_sum(still(), b, Measure::matched, 1, 0).volume;
  }
};

TEST_F(CoincidentInstances, TheWeightFollowsTheMeanSquareDisplacement) {
  const Vector3d centre(0.3 + 2 * tree_.root[0], -0.2 + 2 * tree_.root[1], 0.1 + 2 * tree_.root[2]);
  const double reach = 2 * tree_.root[3];
  int between = 0;
  for (int i = 0; i < 60; ++i) {
    const double size = 0.04 * i * radius_;
    const PlacedAsset b =
        placed(small_pose(size * Vector3d(0.5, 0.1 * (i % 7), -0.4), size * Vector3d(0.4, -1, 0.8)),
               i % 3 == 0 ? 1 + 0.5 * size : 1);
    // The mean over the root ball, by points of a lattice.
    const Eigen::Quaterniond q(b.pose.q[0], b.pose.q[1], b.pose.q[2], b.pose.q[3]);
    double sum = 0, n = 0;
    for (int x = -12; x <= 12; ++x)
      for (int y = -12; y <= 12; ++y)
        for (int z = -12; z <= 12; ++z) {
          const Vector3d offset = Vector3d(x, y, z) / 12.5;
          if (offset.norm() > 1) continue;
          const Vector3d p = centre + reach * offset;
          sum += (q * (b.scale * p) + Vector3d(b.pose.t[0], b.pose.t[1], b.pose.t[2]) - p)
                     .squaredNorm();
          n += 1;
        }
    const double offset = std::sqrt(sum / n) / radius_;
    const double t = std::clamp((1.6 - offset) / 1.2, 0.0, 1.0);
    EXPECT_NEAR(weight(b).weight, t * t * (3 - 2 * t), 0.02) << offset;
    between += t > 0.1 && t < 0.9 ? 1 : 0;
  }
  EXPECT_GE(between, 8);
}

TEST_F(CoincidentInstances, AnswerTheBlendedSumAndItsGradient) {
  const double h = 1e-6;
  for (int i = 0; i < 12; ++i) {
    const double size = 0.11 * i * radius_;
    const PlacedAsset b =
        placed(small_pose(size * Vector3d(0.5, 0.4 - 0.1 * i, -0.4), size * Vector3d(0.5, -0.6, 1)),
               i % 2 == 0 ? 1 : 1 + 0.3 * size);
    const Penetration answer = penetration(still(), b, {}, workspace_);
    const double sum = reference(b);
    EXPECT_NEAR(answer.volume, sum, 1e-5 * sum);
    EXPECT_LE(answer.volume_min, sum * (1 + 1e-12));
    EXPECT_GE(answer.volume_max, sum * (1 - 1e-12));
    if (i == 0) {  // by symmetry
      EXPECT_LE(answer.force.norm(),
                1e-6 * reference_sum(still(), b, Measure::matched, 0, 1).force_scale);
      EXPECT_LE(answer.torque.norm(),
                1e-6 * reference_sum(still(), b, Measure::matched, 0, 1).force_scale);
      continue;
    }
    Vector3d force, torque;
    for (int k = 0; k < 3; ++k) {
      const Vector3d step = h * Vector3d::Unit(k), none = Vector3d::Zero();
      const auto at = [&](const Vector3d& shift, const Vector3d& turn) {
        return reference(placed(moved_by(b.pose, shift, turn), b.scale));
      };
      force[k] = (at(step, none) - at(-step, none)) / (2 * h);
      torque[k] = (at(none, step) - at(none, -step)) / (2 * h);
    }
    const double scale = reference_sum(still(), b, Measure::matched).force_scale;
    EXPECT_LE((answer.force + force).norm(), 1e-5 * scale) << i;
    EXPECT_LE((answer.torque + torque).norm(), 3e-5 * scale) << i;
  }
}

// Half the step, half the largest change: a jump would not shrink.
TEST_F(CoincidentInstances, NothingJumpsAsTheyPart) {
  const Vector3d direction = Vector3d(1, 0.3, -0.2).normalized();
  for (const std::uint32_t budget : {0u, 3'000u}) {
    const auto largest_changes = [&](int steps) {
      std::array<double, 3> largest = {};
      Penetration before;
      for (int i = 0; i <= steps; ++i) {
        // From where equal spheres no longer coincide.
        const double offset = (0.2 + 2.0 * i / steps) * radius_;
        const Penetration now =
            penetration(still(), placed(small_pose(offset * direction, {0, 0, 0.01})),
                        {.pair_budget = budget}, workspace_);
        const std::array changes = {std::abs(now.volume - before.volume),
                                    (now.force - before.force).norm(),
                                    (now.torque - before.torque).norm()};
        for (std::size_t k = 0; i > 0 && k < 3; ++k) largest[k] = std::max(largest[k], changes[k]);
        before = now;
      }
      return largest;
    };
    const auto coarse = largest_changes(200), fine = largest_changes(800);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_LE(fine[k], 0.4 * coarse[k]) << budget << " " << k;
  }
}

TEST_F(CoincidentInstances, PatchesSumToTheSameAnswer) {
  for (const double aside : {0.0, 1e-6, 0.3, 1.0, 3.0}) {
    const PlacedAsset b =
        placed(small_pose(aside * radius_ * Vector3d(0.6, 0.48, 0.64), {0, 0, 0}));
    const Penetration whole = penetration(still(), b, {}, workspace_);
    ContactPatch patches[8];
    const ContactPatches found = contact_patches(still(), b, {}, workspace_, patches);
    EXPECT_NEAR(found.penetration.volume, whole.volume, 1e-12 * whole.volume) << aside;
    EXPECT_LE((found.penetration.force - whole.force).norm(), 1e-9 * whole.force.norm() + 1e-9);
    double sum = 0;
    for (const ContactPatch& patch : std::span(patches).first(found.count)) sum += patch.volume;
    EXPECT_NEAR(sum, whole.volume, 1e-12 * whole.volume) << aside;
  }
}

TEST_F(CoincidentInstances, LimitsHold) {
  int stopped = 0;
  for (int i = 0; i < 200; ++i) {
    const PlacedAsset b = placed(small_pose(0.01 * i * radius_ * Vector3d(1, 1, 0), {0, 0, 0}));
    PenetrationSettings settings;
    if (i % 2 == 1) settings.pair_budget = 2'000;
    const Penetration finished = penetration(still(), b, settings, workspace_);
    settings.max_visits = 1u << (i % 12);
    const Penetration answer = penetration(still(), b, settings, workspace_);
    EXPECT_LE(answer.node_visits, settings.max_visits);
    EXPECT_LE(answer.volume_min, finished.volume);
    EXPECT_GE(answer.volume_max, finished.volume);
    stopped += answer.status == QueryStatus::budget_exhausted ? 1 : 0;
  }
  EXPECT_GT(stopped, 50);
}

TEST(CoincidentInstancesOfASolid, ACopyOnItselfReadsItsVolume) {
  for (const char* const name : {"cube", "gear"}) {
    const Asset asset = bake(close_mesh(make_sample(name), name), {.max_spheres = 4'000});
    const double volume = asset.view().volume();
    const PlacedAsset one{asset.view(), {}, 1};
    Workspace workspace;
    EXPECT_NEAR(penetration(one, one, {}, workspace).volume, volume, 0.025 * volume) << name;
    // The effect that it prevents.
    EXPECT_GT(reference_sum(one, one, Measure::matched).volume, 1.05 * volume) << name;
    // Elsewhere in memory it is the same asset.
    const Asset copy(asset.bytes(), "copy");
    EXPECT_EQ(penetration(one, {copy.view(), {}, 1}, {}, workspace).volume,
              penetration(one, one, {}, workspace).volume);
  }
}

}  // namespace
}  // namespace ist
