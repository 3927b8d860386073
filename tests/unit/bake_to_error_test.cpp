#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/query.h>
#include <ist/types.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <set>
#include <string>

#include "bake/count_search.h"
#include "bake/predict/trial_poses.h"
#include "support/sanitizers.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

// The time of this thread: other programs of a busy machine do not count.
double thread_seconds() {
  timespec now = {};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

constexpr double kLatency = testing::kSanitized ? 4 : 0.2;  // [s]

const ClosedMesh& fine_torus() {  // 50,000 triangles
  static const ClosedMesh mesh = testing::closed(testing::torus_mesh(1.0, 0.4, 250, 100), "torus");
  return mesh;
}

const ClosedMesh& closed_cube() {
  static const ClosedMesh mesh = testing::closed(testing::cube_mesh(), "cube");
  return mesh;
}

/// Sum of the counts tried and the one it ends with, for an error of c / count^power.
struct Walk {
  double tried = 0, found = 0;
};

Walk walk(double c, double power) {
  constexpr double kError = 0.01;
  constexpr std::size_t kMost = 200'000;
  CountSearch search(kError, kMost);
  Walk result;
  for (std::optional<std::size_t> count = CountSearch::first(kMost); count;) {
    const auto spheres = static_cast<double>(*count);
    result.tried += spheres;
    const double error = c / std::pow(spheres, power);
    if (error <= kError && (result.found == 0 || spheres < result.found)) result.found = spheres;
    count = search.next(*count, error);
  }
  return result;
}

TEST(CountSearch, FindsFewSpheresInFewBakes) {
  for (const double power : {0.7, 1.0, 1.4})
    for (const double fewest : {20.0, 300.0, 2'000.0, 30'000.0}) {
      const Walk result = walk(0.01 * std::pow(fewest, power), power);
      EXPECT_GE(result.found, fewest);
      EXPECT_LE(result.found, 2.2 * fewest) << power << " " << fewest;
      EXPECT_LE(result.tried, 4 * result.found + 300) << power << " " << fewest;
    }
}

TEST(CountSearch, EndsWhereNothingDoes) {
  CountSearch search(0.01, 1'000);
  std::optional<std::size_t> count = CountSearch::first(1'000);
  std::size_t last = 0;
  for (; count; count = search.next(*count, 0.5)) {
    EXPECT_GT(*count, last);
    last = *count;
  }
  EXPECT_EQ(last, 1'000u);
}

// The promise holds for poses that neither the search nor the prediction has seen.
TEST(BakeToError, AMetTargetHoldsAtOtherPoses) {
  const ClosedMesh torus = testing::closed(testing::torus_mesh(1.0, 0.4, 40, 20), "torus");
  constexpr ErrorTarget kTarget = {0.03, 0.01};
  const TargetedAsset result = bake_to_error(torus, kTarget);
  EXPECT_TRUE(result.met);
  EXPECT_EQ(result.stop, StopReason::sphere_count);
  EXPECT_GE(result.poses, 40u);
  EXPECT_GT(result.measured_error, 0);
  EXPECT_LE(result.measured_error, kTarget.relative_error);

  const MeshSolid solid(torus);
  const TrialBody body = {solid, result.asset.view()};
  std::vector<double> errors;
  Workspace workspace;
  for (const TrialPose& pose : trial_poses_near(kTarget.at_overlap, body, body, 60, 12345)) {
    EXPECT_TRUE(is_near(pose, kTarget.at_overlap));
    const double volume =
        penetration({body.mesh, {}, 1}, {body.mesh, pose.b_in_a, 1}, {}, workspace).volume;
    errors.push_back(std::abs(volume / pose.volume - 1));
  }
  ASSERT_GE(errors.size(), 50u);
  std::nth_element(errors.begin(), errors.begin() + 30, errors.end());
  EXPECT_LE(errors[30], kTarget.relative_error);

  // The asset contains the values of the result.
  const PredictedErrors errors_in_asset = body.mesh.predicted_errors();
  EXPECT_TRUE(errors_in_asset.target_met());
  EXPECT_EQ(errors_in_asset.measured_error, result.measured_error);
  EXPECT_EQ(errors_in_asset.measured_poses, result.poses);
  EXPECT_EQ(errors_in_asset.target_error, kTarget.relative_error);
  EXPECT_EQ(errors_in_asset.target_overlap, kTarget.at_overlap);

  // But for what the header says of the target it is a bake of that count.
  const Asset plain = bake(torus, {.max_spheres = body.mesh.sphere_count()});
  ASSERT_EQ(plain.bytes().size(), result.asset.bytes().size());
  EXPECT_TRUE(std::equal(plain.bytes().begin() + sizeof(AssetHeader), plain.bytes().end(),
                         result.asset.bytes().begin() + sizeof(AssetHeader)));
  EXPECT_EQ(plain.view().predicted_errors().poses, 0u);
  EXPECT_FALSE(plain.view().predicted_errors().target_met());
  EXPECT_EQ(AssetView().predicted_errors().poses, 0u);
}

TEST(BakeToError, PredictsByClassOfOverlap) {
  const TargetedAsset result = bake_to_error(closed_cube(), {0.2, 0.01});
  const PredictedErrors errors = result.asset.view().predicted_errors();
  EXPECT_GE(errors.poses, 100u);
  double to = 1;
  for (const PredictedErrors::OverlapClass& of : errors.classes) {
    EXPECT_LE(of.to, to);
    EXPECT_LE(of.from, of.to);
    EXPECT_GT(of.median, 0);
    to = of.from;
  }
  EXPECT_EQ(errors.classes.front().from, 1);
  EXPECT_EQ(errors.classes[1].to, 0.5);
  EXPECT_EQ(errors.classes.back().from, 1e-4);
}

TEST(BakeToError, AMissedTargetIsSaidWithItsReason) {
  const TargetedAsset few = bake_to_error(closed_cube(), {0.01, 0.001}, {.max_spheres = 80});
  EXPECT_FALSE(few.met);
  EXPECT_EQ(few.stop, StopReason::sphere_count);
  EXPECT_GT(few.measured_error, 0.01);
  EXPECT_GE(few.poses, 40u);
  const TargetedAsset thin =
      bake_to_error(closed_cube(), {0.05, 0.001}, {.max_spheres = 0, .target_coverage = 0.5});
  EXPECT_FALSE(thin.met);
  EXPECT_EQ(thin.stop, StopReason::coverage);
  EXPECT_GT(thin.measured_error, 0.05);
  EXPECT_FALSE(thin.asset.view().predicted_errors().target_met());
}

// The truth is the solid's, whatever mesh the asset stores.
TEST(BakeToError, MeasuresByTheMeshThatTheAssetDoesNotKeep) {
  const ClosedMesh torus = testing::closed(testing::torus_mesh(1.0, 0.4, 40, 20), "torus");
  PackingSettings settings = {.max_spheres = 200};
  const TargetedAsset own = bake_to_error(torus, {0.2, 0.01}, settings);
  settings.keep_mesh = false;
  const TargetedAsset none = bake_to_error(torus, {0.2, 0.01}, settings);
  EXPECT_FALSE(none.asset.view().has_mesh());
  EXPECT_GT(none.poses, 100u);
  EXPECT_EQ(none.poses, own.poses);
}

TEST(BakeToError, RefusesWhatHasNoExactVolume) {
  ClosedMesh wrong = close_mesh(testing::overlapping_cubes_mesh(), "cubes");
  wrong.meeting_pairs->resize(wrong.meeting_pairs->size() / 2);  // not to be resolved by these
  EXPECT_THROW(bake_to_error(wrong, {0.1, 0.01}, {.max_spheres = 200}), Error);
}

TEST(BakeToError, KeepsToItsTime) {
  constexpr double kLimit = testing::kSanitized ? 20 : 2;  // [s]
  const auto start = std::chrono::steady_clock::now();
  const TargetedAsset result =
      bake_to_error(fine_torus(), {0.0001, 0.001}, {.max_spheres = 0, .time_limit = kLimit});
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  EXPECT_LE(seconds, 1.5 * kLimit);
  EXPECT_EQ(result.stop, StopReason::time_limit);
  EXPECT_FALSE(result.met);
  EXPECT_GT(result.asset.view().sphere_count(), 0u);
}

// Whoever looks on is asked often enough, in every stage, and heard at once.
TEST(BakeToError, IsCancelledWithinAFifthOfASecond) {
  const PackingSettings settings = {.max_spheres = 600, .threads = 1};
  constexpr ErrorTarget kTarget = {0.03, 0.001};
  std::set<std::string> stages;
  double last = thread_seconds(), longest = 0;
  std::string where;
  const auto look = [&](const Progress& now) {
    const double seconds = thread_seconds();
    if (seconds - last > longest) {
      longest = seconds - last;
      where = now.stage;
    }
    last = seconds;
    EXPECT_GE(now.fraction, 0);
    EXPECT_LE(now.fraction, 1);
    stages.insert(now.stage);
    return true;
  };
  bake_to_error(fine_torus(), kTarget, settings, look);
  EXPECT_LE(longest, kLatency) << "before a report of the stage " << where;
  EXPECT_EQ(stages,
            (std::set<std::string>{"calibrate", "cover", "pack", "predict", "resolve", "tree"}));

  for (const std::string& stage : stages) {
    double refused = 0;
    const auto refuse = [&](const Progress& now) {
      if (refused == 0 && now.stage == stage) refused = thread_seconds();
      return refused == 0;
    };
    EXPECT_THROW(bake_to_error(fine_torus(), kTarget, settings, refuse), Error) << stage;
    EXPECT_LE(thread_seconds() - refused, kLatency) << stage;
  }
}

}  // namespace
}  // namespace ist
