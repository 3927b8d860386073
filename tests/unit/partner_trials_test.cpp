#include "bake/predict/partner_trials.h"

#include <gtest/gtest.h>
#include <ist/bake.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "support/shared_data.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

using Eigen::Vector3d;

const ClosedMesh& a_cube() {
  static const ClosedMesh mesh = testing::closed(testing::cube_mesh(), "cube");
  return mesh;
}

const MeshSolid& solid_cube() {
  static const MeshSolid solid(a_cube());
  return solid;
}

TEST(BallPart, OfACubeIsExact) {
  const Eigen::AlignedBox3d bounds = solid_cube().bounds();
  const double r = 0.2 * bounds.sizes().x();
  const auto part = [&](const Vector3d& centre) { return ball_part(solid_cube(), centre, r); };
  const double ball = 4 * std::numbers::pi / 3 * r * r * r;
  const Vector3d out = 0.5 * bounds.sizes();
  EXPECT_NEAR(part(bounds.center()), ball, 1e-12 * ball);
  EXPECT_NEAR(part(bounds.center() + Vector3d(out.x(), 0, 0)), ball / 2, 1e-10 * ball);
  EXPECT_NEAR(part(bounds.center() + Vector3d(out.x(), out.y(), 0)), ball / 4, 1e-10 * ball);
  EXPECT_NEAR(part(bounds.center() + out), ball / 8, 1e-10 * ball);
  EXPECT_EQ(part(bounds.center() + Vector3d(out.x() + 2 * r, 0, 0)), 0);
  // A cap.
  const double h = 0.3 * r, cap = std::numbers::pi / 3 * h * h * (3 * r - h);
  EXPECT_NEAR(part(bounds.center() + Vector3d(0, 0.01 * r, out.z() + r - h)), cap, 1e-10 * ball);
}

TEST(InnerPoints, AreSpreadEvenly) {
  const Eigen::AlignedBox3d bounds = solid_cube().bounds();
  const std::vector<Vector3d> points = inner_points(solid_cube(), 20'000);
  EXPECT_NEAR(static_cast<double>(points.size()), 20'000, 1'000);
  const Eigen::AlignedBox3d part(bounds.min() + 0.1 * bounds.sizes(),
                                 bounds.min() + 0.6 * bounds.sizes());
  const auto inside =
      std::count_if(points.begin(), points.end(), [&](const auto& x) { return part.contains(x); });
  EXPECT_NEAR(static_cast<double>(inside), 0.125 * static_cast<double>(points.size()), 150);
  for (const Vector3d& x : points) EXPECT_TRUE(bounds.contains(x));
}

TEST(PartnerTrials, HoldTheOverlapAskedFor) {
  constexpr double kOverlap = 0.003;
  const Asset asset = bake(a_cube(), {.max_spheres = 2'000});
  const PartnerTrials trials(solid_cube(), asset.view());
  Workspace workspace;
  for (const TrialPartner partner : kOtherPartners) {
    const auto found = trials.find(partner, kOverlap, 8, 5);
    EXPECT_EQ(found.size(), 8u) << static_cast<int>(partner);
    for (const PartnerTrial& trial : found) {
      const double share = trial.volume / solid_cube().volume();
      EXPECT_GE(share, kOverlap / 3.2);
      EXPECT_LE(share, kOverlap * 3.2);
      // Spheres know it to some per cent; of thin plates less.
      const double volume = penetration(trial.partner, {asset.view(), {}}, {}, workspace).volume;
      EXPECT_NEAR(volume, trial.volume, 0.2 * trial.volume) << static_cast<int>(partner);
    }
  }
  EXPECT_TRUE(trials.find(TrialPartner::ball, 0.5, 4, 5).empty()) << "no room for so much";
}

TEST(PartnerTrials, AreTheSameForAnyNumberOfThreads) {
  const auto trials_of = [](int threads) {
    return tbb::task_arena(threads).execute([] {
      const Asset surface = bake_mesh_only(a_cube());
      return PartnerTrials(solid_cube(), surface.view()).find(TrialPartner::corner, 0.001, 4, 3);
    });
  };
  const auto one = trials_of(1), many = trials_of(4);
  ASSERT_EQ(one.size(), many.size());
  ASSERT_FALSE(one.empty());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].volume, many[i].volume);
    EXPECT_EQ(std::memcmp(&one[i].partner.pose, &many[i].partner.pose, sizeof(Pose)), 0);
  }
}

TEST(BakeToError, NamesTheWorstPartner) {
  const TargetedAsset result = bake_to_error(a_cube(), {0.05, 0.003});
  EXPECT_TRUE(result.met);
  double worst = 0;
  TrialPartner partner = TrialPartner::copy;
  std::uint32_t poses = 0;
  for (const PartnerError& of : result.partners) {
    EXPECT_GE(of.poses, 20u) << static_cast<int>(of.partner);
    poses += of.poses;
    if (of.median >= worst) worst = of.median, partner = of.partner;
  }
  EXPECT_EQ(result.measured_error, worst);
  EXPECT_EQ(result.poses, poses);
  const PredictedErrors errors = result.asset.view().predicted_errors();
  EXPECT_EQ(errors.worst_partner, partner);
  EXPECT_EQ(errors.measured_error, worst);
  EXPECT_NE(partner, TrialPartner::copy) << "faces of copies are kinder than edges and plates";
}

// Its copies alone were content with 2,443.
TEST(BakeToError, ThinPartsTakeMoreSpheresThanCopiesTell) {
  constexpr const char* kTray = "meshes/dev/tray_perforated.stl";
  IST_NEEDS_SHARED(kTray);
  const ClosedMesh tray = close_mesh(load_mesh(testing::shared_path(kTray).string()), "tray");
  const TargetedAsset result = bake_to_error(tray, {0.02, 0.01});
  EXPECT_TRUE(!result.met || result.asset.view().sphere_count() > 2'600);
  EXPECT_GE(result.poses, 120u);
}

}  // namespace
}  // namespace ist
