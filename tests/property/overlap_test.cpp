#include <gtest/gtest.h>
#include <ist/query.h>

#include <array>
#include <limits>

#include "support/float_traps.h"
#include "support/random_assets.h"
#include "support/reference_sum.h"

namespace ist {
namespace {

using testing::make_random_asset;
using testing::random_pose;

/// The certain answer, from all pairs of inner spheres and of covers, in double.
struct Truth {
  bool spheres_meet = false, covers_meet = false;
};

Truth truth_of(const PlacedAsset& a, const PlacedAsset& b) {
  const auto spheres_a = testing::world_spheres(a, Measure::inner);
  const auto spheres_b = testing::world_spheres(b, Measure::inner);
  Truth truth;
  for (const testing::WorldSphere& i : spheres_a)
    for (const testing::WorldSphere& j : spheres_b) {
      const double d = (i.centre - j.centre).norm();
      truth.spheres_meet |= d < i.r + j.r;
      truth.covers_meet |= d < i.cover + j.cover;
    }
  return truth;
}

TEST(Overlap, SaysWhatIsCertain) {
  Workspace workspace;
  std::mt19937_64 random(3);
  std::array<int, 3> said = {};
  for (const std::size_t n : {1u, 7u, 17u, 300u, 700u}) {
    const Asset a = make_random_asset({n, 0.2, {1, 2, 3}, 1}, 20);
    const Asset b = make_random_asset({n / 2 + 1, 0.1, {}, 0}, 21);
    for (int i = 0; i < 60; ++i) {
      const double scale = i % 3 == 0 ? 1e-3 : 1.7;
      const PlacedAsset pa{a.view(), random_pose(random, 1), 1};
      PlacedAsset pb{b.view(), random_pose(random, 0), scale};
      const Eigen::Vector3d to = testing::random_vector(
          [&] { return std::uniform_real_distribution<double>(-3.5, 3.5)(random); });
      const Eigen::Vector3d centre =
          Eigen::Quaterniond(pa.pose.q[0], pa.pose.q[1], pa.pose.q[2], pa.pose.q[3]) *
          Eigen::Vector3d(1, 2, 3);
      for (int k = 0; k < 3; ++k) pb.pose.t[k] = pa.pose.t[k] + centre[k] + to[k];
      const Truth truth = truth_of(pa, pb);
      for (const YesNoAnswer answer : {overlap(pa, pb, workspace), overlap(pb, pa, workspace)}) {
        ++said[static_cast<std::size_t>(answer.answer)];
        // With 256 visits all is found out about trees of this size.
        const YesNo expected = truth.spheres_meet  ? YesNo::yes
                               : truth.covers_meet ? YesNo::unknown
                                                   : YesNo::no;
        EXPECT_EQ(answer, expected) << n << " spheres, pose " << i;
      }
    }
  }
  for (const int times : said) EXPECT_GT(times, 50);
}

TEST(Overlap, NeedsTimeAndRoom) {
  const Asset a = make_random_asset({700, 0.2, {}, 0}, 20);
  const PlacedAsset pa{a.view(), {}, 1}, near{a.view(), {{1, 0, 0, 0}, {1.9, 0, 0}}, 1};
  Workspace workspace, small(64);
  ASSERT_NE(overlap(pa, near, workspace), YesNo::no);
  const YesNoAnswer hurried = overlap(pa, near, small);
  EXPECT_TRUE(hurried == YesNo::unknown || hurried == overlap(pa, near, workspace).answer);

  const testing::NoFloatTraps with_nan;
  PlacedAsset wrong = pa;
  wrong.scale = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(overlap(pa, wrong, workspace), YesNo::unknown);
  EXPECT_EQ(overlap(PlacedAsset(), pa, workspace), YesNo::unknown);
  EXPECT_EQ(overlap(PlacedShape{BallShape{-1}, {}}, pa, workspace), YesNo::unknown);
  Workspace taken = std::move(workspace);
  EXPECT_EQ(overlap(pa, pa, workspace), YesNo::unknown);  // NOLINT: what is tested
  EXPECT_EQ(overlap(pa, pa, taken), YesNo::yes);
}

/// Half a distance: a valid bound.
ShapeSample cautious_plane(const void*, const Eigen::Vector3d& x) noexcept {
  return {0.5 * x.z(), {0, 0, 0.5}};
}

TEST(Overlap, OfFields) {
  Workspace workspace;
  std::mt19937_64 random(5);
  std::array<int, 3> said = {};
  const Asset b = make_random_asset({300, 0.2, {}, 0}, 21);
  for (int i = 0; i < 400; ++i) {
    const double scale = i % 2 == 0 ? 0.3 : 2;
    PlacedAsset pb{b.view(), random_pose(random, 0), scale};
    pb.pose.t[2] = scale * (0.7 + 0.002 * i);
    Truth plane, ball;
    bool centre_below = false;
    for (const testing::WorldSphere& sphere : testing::world_spheres(pb, Measure::inner)) {
      const double above = sphere.centre.z(), off = sphere.centre.norm() - 0.4;
      plane.spheres_meet |= above < sphere.r;
      plane.covers_meet |= above < sphere.cover;
      centre_below |= above < 0;
      ball.spheres_meet |= off < sphere.r;
      ball.covers_meet |= off < sphere.cover;
    }
    const auto expected = [](const Truth& truth) {
      return truth.spheres_meet ? YesNo::yes : truth.covers_meet ? YesNo::unknown : YesNo::no;
    };
    const YesNoAnswer of_plane = overlap(PlacedShape{HalfSpaceShape(), {}}, pb, workspace);
    EXPECT_EQ(of_plane, expected(plane)) << i;
    EXPECT_EQ(overlap(PlacedShape{BallShape{0.4}, {}}, pb, workspace), expected(ball)) << i;
    ++said[static_cast<std::size_t>(of_plane.answer)];
    // Distances that are too small make nothing certain that is not.
    const PlacedShape careful{FunctionShape{cautious_plane}, {}};
    const YesNoAnswer cautious = overlap(careful, pb, workspace);
    EXPECT_TRUE(cautious != YesNo::yes || centre_below) << i;
    EXPECT_TRUE(cautious != YesNo::no || !plane.covers_meet) << i;
    EXPECT_TRUE(cautious == YesNo::yes || !centre_below) << i;
  }
  for (const int times : said) EXPECT_GT(times, 20);
}

}  // namespace
}  // namespace ist
