#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/query.h>
#include <ist/types.h>
#include <tbb/task_arena.h>

#include <array>
#include <cstring>

#include "bake/predict/trial_poses.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

struct Baked {
  ClosedMesh mesh;
  MeshSolid solid;
  Asset asset;
  explicit Baked(ClosedMesh closed)
      : mesh(std::move(closed)), solid(mesh), asset(bake(mesh, {.max_spheres = 600})) {}
  TrialBody body() const { return {solid, asset.view()}; }
};

const Baked& baked_torus() {
  static const Baked solid(testing::closed(testing::torus_mesh(1.0, 0.4, 40, 20), "torus"));
  return solid;
}
const Baked& baked_cube() {
  static const Baked solid(testing::closed(testing::cube_mesh(), "cube"));
  return solid;
}

TEST(TrialPoses, EveryClassHasItsPosesAndTheirTruth) {
  const auto poses = trial_poses(baked_torus().body(), baked_cube().body(), 6, 7);
  std::array<int, kOverlapClasses> found = {};
  Workspace workspace;
  for (const TrialPose& pose : poses) {
    const std::uint32_t k = pose.overlap_class;
    ++found[k];
    const double smaller =
        std::min(baked_torus().solid.volume(),
                 pose.scale_b * pose.scale_b * pose.scale_b * baked_cube().solid.volume());
    EXPECT_NEAR(pose.fraction, pose.volume / smaller, 1e-9);
    EXPECT_GE(pose.fraction, kOverlapClassFloor[k] * (k == 0 ? 1 - 1e-9 : 1));
    if (k > 1) {
      EXPECT_LT(pose.fraction, kOverlapClassFloor[k - 1]);
    }
    // The spheres alone know the volume to some per cent, of shallow overlaps the order.
    const double matched =
        penetration({baked_torus().asset.view(), {}, 1},
                    {baked_cube().asset.view(), pose.b_in_a, pose.scale_b}, {}, workspace)
            .volume;
    const double factor = k <= 1 ? 1.05 : k == 2 ? 1.3 : 4;
    EXPECT_LE(matched, factor * pose.volume) << k;
    EXPECT_GE(matched, pose.volume / factor) << k;
  }
  for (const int count : found) EXPECT_GE(count, 3);
}

TEST(TrialPoses, AreTheSameForAnyNumberOfThreads) {
  const auto poses_of = [&](int threads) {
    return tbb::task_arena(threads).execute(
        [&] { return trial_poses(baked_cube().body(), baked_cube().body(), 3, 3); });
  };
  const auto one = poses_of(1), many = poses_of(4);
  ASSERT_EQ(one.size(), many.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].volume, many[i].volume);
    EXPECT_EQ(std::memcmp(&one[i].b_in_a, &many[i].b_in_a, sizeof(Pose)), 0);
  }
  EXPECT_NE(trial_poses(baked_cube().body(), baked_cube().body(), 3, 4)[0].b_in_a.t[0],
            one[0].b_in_a.t[0]);
}

// A ball takes few spheres, a cube many, and a harder target more.
TEST(BakeToError, TakesAsManySpheresAsItNeeds) {
  const ClosedMesh ball = testing::closed(testing::icosphere_mesh(4), "ball");
  const Asset easy = bake_to_error(ball, {0.03, 0.01}).asset;
  const AssetHeader& header = easy.view().header();
  EXPECT_LE(header.sphere_count, 60u);
  EXPECT_LE(header.predicted_error[2], 0.03);
  EXPECT_GE(header.predicted_poses, 100u);
  EXPECT_EQ(header.asked_error, 0.03);
  EXPECT_EQ(header.asked_at_overlap, 0.01);

  const Asset coarse =
      bake_to_error(baked_cube().mesh, {0.1, 0.01}, {.max_spheres = 0, .threads = 1}).asset;
  const Asset fine = bake_to_error(baked_cube().mesh, {0.04, 0.01}, {.max_spheres = 0}).asset;
  EXPECT_GT(coarse.view().sphere_count(), header.sphere_count);
  EXPECT_GT(fine.view().sphere_count(), coarse.view().sphere_count());
  EXPECT_LT(fine.view().header().predicted_error[2], coarse.view().header().predicted_error[2]);

  // Any number of threads finds the same.
  const Asset again =
      bake_to_error(baked_cube().mesh, {0.1, 0.01}, {.max_spheres = 0, .threads = 3}).asset;
  EXPECT_TRUE(std::equal(again.bytes().begin(), again.bytes().end(), coarse.bytes().begin(),
                         coarse.bytes().end()));
}

TEST(BakeToError, RefusesSenseless) {
  EXPECT_THROW(bake_to_error(baked_cube().mesh, {0.0, 0.01}), Error);
  EXPECT_THROW(bake_to_error(baked_cube().mesh, {0.01, 0.9}), Error);
}

// If the maximum is not enough, all of it is taken.
TEST(BakeToError, StopsAtTheMostThatIsAllowed) {
  const Asset asset = bake_to_error(baked_cube().mesh, {0.01, 0.001}, {.max_spheres = 80}).asset;
  EXPECT_EQ(asset.view().sphere_count(), 80u);
  EXPECT_GT(asset.view().header().predicted_error[3], 0.01);
}

}  // namespace
}  // namespace ist
