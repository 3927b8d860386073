#include <gtest/gtest.h>
#include <ist/query.h>

#include <memory>

#include "samples/samples.h"
#include "support/baked.h"
#include "support/by_shares.h"
#include "support/nut_on_bolt.h"
#include "support/random_pairs.h"
#include "support/sanitizers.h"

// What a deadline leaves of a sum: shares of its leaves that stand for all.

namespace ist {
namespace {

using Eigen::Vector3d;

class QueryShares : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    bolt_ = std::make_unique<Asset>(testing::baked(make_sample("bolt"), "bolt", 4000));
    nut_ = std::make_unique<Asset>(testing::baked(make_sample("nut"), "nut", 4000));
  }
  static void TearDownTestSuite() {
    bolt_.reset();
    nut_.reset();
  }

  /// B against A by no more than so many shares of sixteen.
  Penetration ask(const Asset& asset_a, const Asset& asset_b, const Pose& pose_b, double shares) {
    return testing::by_shares({asset_a.view(), {}, 1}, {asset_b.view(), pose_b, 1}, shares,
                              workspace_);
  }

  /// The nut into the bolt.
  Penetration ask(const Pose& nut, double shares) { return ask(*bolt_, *nut_, nut, shares); }

  /// In the thread, a little off and tilted: all flanks touch somewhere.
  static Pose engaged(double down) {
    const double lead = testing::kNutPitch / (2 * std::numbers::pi);
    const Eigen::Quaterniond q = Eigen::AngleAxisd(0.004, Vector3d::UnitX()) *
                                 Eigen::AngleAxisd((3 - down) / lead, Vector3d::UnitZ());
    return {{q.w(), q.x(), q.y(), q.z()}, {0.03, 0.02, 11.03 - down}};
  }

  static std::unique_ptr<Asset> bolt_, nut_;
  Workspace workspace_;
};
std::unique_ptr<Asset> QueryShares::bolt_, QueryShares::nut_;

TEST_F(QueryShares, GradientsAreThoseOfTheAnswer) {
  const double h = 1e-4;
  for (const double shares : {1.0, 2.4, 5.5, 13.2, 16.7}) {
    for (double down = 0; down < 6; down += 1.3) {
      const Pose pose = engaged(down);
      const Penetration answer = ask(pose, shares);
      ASSERT_EQ(answer.status, QueryStatus::budget_exhausted);
      for (int k = 0; k < 3; ++k) {
        Pose more = pose, less = pose;
        more.t[k] += h;
        less.t[k] -= h;
        const double slope = (ask(more, shares).volume - ask(less, shares).volume) / (2 * h);
        EXPECT_NEAR(answer.translation_gradient[k], slope,
                    2e-3 * (1 + answer.translation_gradient.norm()))
            << shares << " " << down;
      }
    }
  }
}

TEST_F(QueryShares, AnswersAreContinuousInTheRoomForThem) {
  const Pose pose = engaged(1);
  double before = ask(pose, 1).volume;
  for (double shares = 1; shares <= 17; shares += 0.01) {
    const Penetration answer = ask(pose, shares);
    EXPECT_NEAR(answer.volume, before, 0.02 * before) << shares;
    EXPECT_LE(answer.volume_min, answer.volume);
    EXPECT_GE(answer.volume_max, answer.volume);
    before = answer.volume;
  }
  const Penetration finished = penetration({bolt_->view(), {}, 1}, {nut_->view(), pose, 1},
                                           {.field = FieldUse::never}, workspace_);
  const Penetration all = ask(pose, 17);
  EXPECT_EQ(all.status, QueryStatus::ok);
  EXPECT_NEAR(all.volume, finished.volume, 1e-5 * finished.volume);
  EXPECT_NEAR(before, finished.volume, 1e-3 * finished.volume);
}

/// Half of the way across a solid's box.
double half_size(const char* sample) {
  Eigen::AlignedBox3d box;
  for (const Vector3d& vertex : make_sample(sample).vertices) box.extend(vertex);
  return box.sizes().norm() / 2;
}

// Over many poses: where a sample of few blocks happens to lie says little.
TEST_F(QueryShares, StandForAllOnAverage) {
  const Asset gear = testing::baked(make_sample("gear"), "gear", 2000, false);
  const Asset knot = testing::baked(make_sample("torus_knot"), "torus_knot", 2000, false);
  const struct {
    const Asset &a, &b;
    double reach;  ///< of both solids
  } pairs[] = {{*bolt_, *nut_, half_size("bolt") + half_size("nut")},
               {gear, gear, 2 * half_size("gear")},
               {knot, gear, half_size("torus_knot") + half_size("gear")}};
  testing::RandomPairs random(29);
  for (const auto& pair : pairs) {
    double sum = 0, squares = 0;
    int asked = 0;
    while (asked < 100) {
      Pose pose = random.pose(1);
      const Vector3d way = random.uniform(0.05, 0.4) * pair.reach * Vector3d(pose.t).normalized();
      for (int k = 0; k < 3; ++k) pose.t[k] = way[k];
      const Penetration whole = ask(pair.a, pair.b, pose, 17);
      if (whole.sphere_pairs < 500) continue;
      ++asked;
      const double off = ask(pair.a, pair.b, pose, 6).volume / whole.volume - 1;
      sum += off;
      squares += off * off;
    }
    // Two standard deviations of the mean of 47 of 125 blocks whose volumes differ by as much as
    // they measure; one pose alone meets few of them.
    EXPECT_NEAR(sum / asked, 0, 0.23);
    EXPECT_LT(std::sqrt(squares / asked), 0.6);
  }
}

// Without friction or damping energy can only stay: what the contact gives to a nut that turns down
// a bolt was there before. Below some six shares it is a matter of luck, in this order of the
// leaves or another, whether the nut turns.
TEST_F(QueryShares, ANutTurnsDownABoltWithoutGainingEnergy) {
  if (testing::kSanitized) GTEST_SKIP() << "takes minutes";
  const testing::MassProperties mass =
      testing::mass_properties(make_sample("nut"), testing::kSteel);
  constexpr double kStiffness = 3;  // [mN/mm³]
  for (const std::size_t spheres : {2000, 4000, 8000}) {
    const Asset bolt = testing::baked(make_sample("bolt"), "bolt", spheres, false);
    const Asset nut = testing::baked(make_sample("nut"), "nut", spheres, false);
    for (const double shares : {17.0, 11.5, 9.0, 7.7, 6.6}) {
      const testing::NutRun run =
          testing::run_nut(mass, kStiffness, 1000, 1.5,
                           [&](const Pose& pose) { return ask(bolt, nut, pose, shares); });
      EXPECT_GT(run.travel, 6.9) << spheres << " " << shares;
      EXPECT_NEAR(run.turns, -3.5, 0.1) << spheres << " " << shares;
      EXPECT_LT(run.grown, 0.02) << spheres << " " << shares;
    }
  }
}

}  // namespace
}  // namespace ist
