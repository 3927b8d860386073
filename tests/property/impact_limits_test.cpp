#include <gtest/gtest.h>
#include <ist/time_of_impact.h>

#include <cmath>
#include <limits>
#include <random>

#include "support/float_traps.h"
#include "support/impact_bodies.h"

// Times of impact at the edge: solids that contain or slide along each other, limits that bind,
// input that is none, sizes and places far off.

namespace ist {
namespace {

using namespace testing;

TEST(TimeOfImpact, OneHoldsTheOther) {
  for (const bool first : {false, true}) {
    const PlacedAsset small{torus().view(), {}, 0.1}, large{cube().view(), {}, 1};
    const TimeOfImpact found =
        first ? time_of_impact(small, large, {}, {}, workspace())
              : time_of_impact(large, small, {{}, straight({1, 0, 0})}, {}, workspace());
    EXPECT_EQ(found.kind, ImpactKind::overlapping);
    EXPECT_EQ(found.time, 0);
  }
  const PlacedAsset large{cube().view(), {}, 1};
  for (const Shape& inside : {Shape{BallShape{0.1}}, Shape{BoxShape{{0.1, 0.1, 0.1}}},
                              Shape{BallShape{2}}, Shape{HalfSpaceShape{{0, 0, 1}, 1}}})
    EXPECT_EQ(time_of_impact(PlacedShape{inside, {}, 1}, large, {}, {}, workspace()).kind,
              ImpactKind::overlapping);
  // In the hole of a ring it is free.
  const TimeOfImpact free =
      time_of_impact(PlacedAsset{torus().view(), {}, 1}, {cube().view(), {}, 0.2},
                     {{}, straight({0, 0, 3})}, {}, workspace());
  EXPECT_EQ(free.kind, ImpactKind::no_impact);
}

TEST(TimeOfImpact, WhatSlidesOrPartsIsNoImpact) {
  ImpactSettings settings;
  settings.tolerance = 1e-2;
  const double gap = 1e-3;  // nearer than the tolerance
  const PlacedAsset floor{wall().view(), {}, 1}, box{cube().view(), at({0, 0, 1.5 + gap}), 1};
  const Motion slide = straight({30, 7, 0}), part = straight({1, 0, 1}),
               sink = straight({0, 0, -1});
  const Motion spin{{1, 2, 0}, {0, 0, 5}, Vector3d::Zero()};
  for (const Motion& motion : {slide, part, spin, Motion{}}) {
    EXPECT_EQ(time_of_impact(floor, box, {{}, motion}, settings, workspace()).kind,
              ImpactKind::no_impact);
    EXPECT_EQ(time_of_impact(PlacedShape{HalfSpaceShape{}, at({0, 0, 1}), 1}, box, {{}, motion},
                             settings, workspace())
                  .kind,
              ImpactKind::no_impact);
  }
  const TimeOfImpact found = time_of_impact(floor, box, {{}, sink}, settings, workspace());
  EXPECT_EQ(found.kind, ImpactKind::impact);
  EXPECT_EQ(found.time, 0);
  // Both move alike, however fast.
  EXPECT_EQ(time_of_impact(floor, box, {straight({1e6, 1e6, 1e6}), straight({1e6, 1e6, 1e6})},
                           settings, workspace())
                .kind,
            ImpactKind::no_impact);
}

TEST(TimeOfImpact, LimitsKeepWhatIsCertain) {
  std::mt19937_64 random(7);
  ImpactSettings settings;
  settings.tolerance = 1e-4;
  for (int i = 0; i < 20; ++i) {
    const PlacedAsset a{torus().view(), random_pose(random, 0), 1};
    const PlacedAsset b{ball().view(), random_pose(random, 2), 0.3};
    Motions motions{{}, random_motion(random, 0.1, 2)};
    motions.b.velocity -= 2 * Vector3d(b.pose.t[0], b.pose.t[1], b.pose.t[2]);
    const TimeOfImpact whole = time_of_impact(a, b, motions, settings, workspace());
    double before = 0;
    for (std::uint32_t visits = 1; visits < 2 * whole.node_visits; visits *= 2) {
      ImpactSettings few = settings;
      few.max_visits = visits;
      const TimeOfImpact found = time_of_impact(a, b, motions, few, workspace());
      EXPECT_LE(found.node_visits, visits);
      EXPECT_GE(found.time, before);
      EXPECT_LE(found.time, whole.time);
      before = found.time;
      if (visits >= whole.node_visits) {
        EXPECT_EQ(found.status, whole.status);
        EXPECT_EQ(found.time, whole.time);
      } else {
        EXPECT_EQ(found.status, QueryStatus::budget_exhausted);
      }
    }
    Workspace little(1);
    const TimeOfImpact small = time_of_impact(a, b, motions, settings, little);
    EXPECT_LE(small.time, whole.time);
    // Nothing of a query stays in the workspace.
    const TimeOfImpact again = time_of_impact(a, b, motions, settings, workspace());
    EXPECT_EQ(again.time, whole.time);
    EXPECT_EQ(again.node_visits, whole.node_visits);
  }
}

TEST(TimeOfImpact, RefusesWhatIsNoInput) {
  const NoFloatTraps untrapped;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const PlacedAsset a{cube().view(), {}, 1}, b{ball().view(), at({3, 0, 0}), 1};
  const auto status = [&](const PlacedAsset& x, const PlacedAsset& y, const Motions& motions,
                          double duration) {
    ImpactSettings settings;
    settings.duration = duration;
    const TimeOfImpact found = time_of_impact(x, y, motions, settings, workspace());
    EXPECT_EQ(std::isnan(found.time) && std::isnan(found.distance_min) && found.normal.hasNaN(),
              found.status == QueryStatus::invalid_input);
    return found.status;
  };
  constexpr QueryStatus kInvalid = QueryStatus::invalid_input;
  EXPECT_EQ(status(a, b, {}, 1), QueryStatus::ok);
  for (const double bad : {nan, inf, -inf, -1.0, 0.0}) EXPECT_EQ(status(a, b, {}, bad), kInvalid);
  for (const double bad : {nan, inf}) {
    for (int k = 0; k < 3; ++k) {
      Motion velocity, spin, about;
      velocity.velocity[k] = spin.angular_velocity[k] = about.about[k] = bad;
      for (const Motion& motion : {velocity, spin, about}) {
        EXPECT_EQ(status(a, b, {motion, {}}, 1), kInvalid);
        EXPECT_EQ(status(a, b, {{}, motion}, 1), kInvalid);
      }
    }
  }
  EXPECT_EQ(status(a, b, {{}, straight({1e70, 0, 0})}, 1), kInvalid);
  EXPECT_EQ(status(a, b, {{}, {Vector3d::Zero(), {1e300, 1e300, 0}, Vector3d::Zero()}}, 1e300),
            kInvalid);
  EXPECT_EQ(status({}, b, {}, 1), kInvalid);
  EXPECT_EQ(status(a, {ball().view(), {{0, 0, 0, 0}, {3, 0, 0}}, 1}, {}, 1), kInvalid);
  EXPECT_EQ(status(a, {ball().view(), at({3, 0, 0}), -1}, {}, 1), kInvalid);
  EXPECT_EQ(status(a, b, {{}, motion_between({}, {}, 0)}, 1), kInvalid);
  EXPECT_EQ(status(a, b, {{}, motion_between({}, {{0, 0, 0, 0}, {}}, 1)}, 1), kInvalid);
  const auto of_field = [&](const Shape& field) {
    return time_of_impact(PlacedShape{field, {}, 1}, b, {}, {}, workspace()).status;
  };
  EXPECT_EQ(of_field(BallShape{-1}), kInvalid);
  EXPECT_EQ(of_field(HalfSpaceShape{{0, 0, 0}, 0}), kInvalid);
  EXPECT_EQ(of_field(FunctionShape{
                [](const void*, const Vector3d&) noexcept {
                  return ShapeSample{std::numeric_limits<double>::quiet_NaN(), Vector3d::Zero()};
                },
                nullptr, 0}),
            kInvalid);
  Workspace gone;
  const Workspace taken = std::move(gone);
  EXPECT_EQ(time_of_impact(a, b, {}, {}, gone).status,
            kInvalid);  // NOLINT(bugprone-use-after-move)
}

/// The same scene at any size and anywhere has the same time.
TEST(TimeOfImpact, KnowsNoScaleOrPlace) {
  std::mt19937_64 random(8);
  for (int i = 0; i < 10; ++i) {
    const Pose pose = random_pose(random, 2.5);
    Motion motion = random_motion(random, 0.1, 3);
    motion.velocity -= 2 * Vector3d(pose.t[0], pose.t[1], pose.t[2]);
    const TimeOfImpact want =
        time_of_impact(PlacedAsset{torus().view(), {}, 1}, {cube().view(), pose, 1}, {{}, motion},
                       {}, workspace());
    ASSERT_EQ(want.kind, ImpactKind::impact);
    for (const double size : {0x1p-20, 0x1p20}) {
      for (const double far : {0.0, 1e6}) {
        Pose pose_a, pose_b = pose;
        for (int k = 0; k < 3; ++k) {
          pose_a.t[k] = far * size;
          pose_b.t[k] = size * pose.t[k] + far * size;
        }
        Motion scaled = motion;
        scaled.velocity *= size;
        const TimeOfImpact found =
            time_of_impact(PlacedAsset{torus().view(), pose_a, size}, {cube().view(), pose_b, size},
                           {{}, scaled}, {}, workspace());
        EXPECT_EQ(found.status, want.status);
        EXPECT_NEAR(found.time, want.time, far == 0 ? 0 : 1e-4);
      }
    }
    // Twice as fast in half the time.
    Motion fast = motion;
    fast.velocity *= 0x1p20;
    fast.angular_velocity *= 0x1p20;
    ImpactSettings settings;
    settings.duration = 0x1p-20;
    const TimeOfImpact found =
        time_of_impact(PlacedAsset{torus().view(), {}, 1}, {cube().view(), pose, 1}, {{}, fast},
                       settings, workspace());
    EXPECT_EQ(0x1p20 * found.time, want.time);
  }
}

}  // namespace
}  // namespace ist
