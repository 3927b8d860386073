#include <gtest/gtest.h>
#include <ist/contact_law.h>
#include <ist/shapes.h>
#include <ist/time_of_impact.h>

#include <vector>

#include "support/random_assets.h"
#include "support/reference_sum.h"

namespace ist {
namespace {

using Eigen::Vector3d;
using testing::make_random_asset;
using testing::random_pose;

class Wrenching : public ::testing::Test {
 protected:
  Vector3d vector(double size) {
    std::uniform_real_distribution<double> uniform(-size, size);
    return testing::random_vector([&] { return uniform(random_); });
  }
  Motion motion() { return {vector(1), vector(1), vector(3)}; }

  std::mt19937_64 random_{7};
  Workspace workspace_;
};

/// A force and its opposite at one point.
void expect_opposite(const Wrenches& about_one_point) {
  EXPECT_EQ(about_one_point.on_a.force, -about_one_point.on_b.force);
  EXPECT_LE((about_one_point.on_a.torque + about_one_point.on_b.torque).norm(),
            1e-15 * (about_one_point.on_b.torque.norm() + about_one_point.on_b.force.norm()));
}

TEST_F(Wrenching, RatesAreThoseOfTheVolume) {
  const Asset a = make_random_asset({300, 0.2, {0.5, 0, -1}, 0}, 10);
  const Asset b = make_random_asset({200, 0.3, {}, -1}, 11);
  constexpr double kStep = 1e-5;
  int met = 0;
  for (int i = 0; i < 60; ++i) {
    const PlacedAsset pa{a.view(), random_pose(random_, 0.5), 1.3};
    const PlacedAsset pb{b.view(), random_pose(random_, 1), 0.9};
    const Penetration contact = penetration(pa, pb, {}, workspace_);
    if (contact.volume == 0) continue;
    ++met;
    const Motion motion_a = motion(), motion_b = motion();
    const auto volume = [&](double time) {
      return testing::reference_sum({pa.asset, moved(pa.pose, motion_a, time, pa.scale), pa.scale},
                                    {pb.asset, moved(pb.pose, motion_b, time, pb.scale), pb.scale},
                                    Measure::matched)
          .volume;
    };
    const double expected = (volume(kStep) - volume(-kStep)) / (2 * kStep);
    const double scale = contact.force.norm() + contact.torque.norm();
    EXPECT_NEAR(volume_rate(contact, pa, pb, motion_a, motion_b), expected, 2e-3 * scale);

    // Moving along together, nothing changes.
    const Vector3d at_a = world_point(pa, motion_a.about), at_b = world_point(pb, motion_b.about);
    Motion along = motion_a;
    along.about = motion_b.about;
    along.velocity += motion_a.angular_velocity.cross(at_b - at_a);
    EXPECT_NEAR(volume_rate(contact, pa, pb, motion_a, along), 0, 1e-13 * 10 * scale);

    // The same force at another point is the same motion.
    const Vector3d point = vector(5);
    expect_opposite(wrenches(contact, pb.pose, point, point));
    const Wrench there = wrenches(contact, pb.pose, point, at_b).on_b;
    const Wrench back = about(there, at_b, point);
    EXPECT_LE((back.torque - wrenches(contact, pb.pose, point, point).on_b.torque).norm(),
              1e-14 * 10 * scale);
  }
  EXPECT_GT(met, 20);
}

TEST_F(Wrenching, OfFieldsAndOfPatches) {
  const Asset b = make_random_asset({200, 0.3, {}, 0}, 11);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 20; ++i) {
    const PlacedShape pa{BoxShape{Vector3d(3, 2, 1)}, random_pose(random_, 0.3)};
    const PlacedAsset pb{b.view(), random_pose(random_, 1.5), 0.7};
    std::vector<ContactPatch> patches(6);
    const ContactPatches found = contact_patches(pa, pb, {}, workspace_, patches);
    ASSERT_GT(found.count, 0u);
    const Motion motion_a = motion(), motion_b = motion();
    const auto volume = [&](double time) {
      return penetration(PlacedShape{pa.shape, moved(pa.pose, motion_a, time, pa.scale)},
                         {pb.asset, moved(pb.pose, motion_b, time, pb.scale), pb.scale}, {},
                         workspace_)
          .volume;
    };
    const double expected = (volume(kStep) - volume(-kStep)) / (2 * kStep);
    const Penetration& whole = found.penetration;
    const double scale = whole.force.norm() + whole.torque.norm();
    EXPECT_NEAR(volume_rate(whole, pa, pb, motion_a, motion_b), expected, 1e-4 * (scale + 0.01));
    double rate = 0;
    Wrench on_a;
    const Vector3d at_a = world_point(pa, motion_a.about);
    for (std::size_t k = 0; k < found.count; ++k) {
      const Wrenches push = wrenches(patches[k], pb.pose, at_a, at_a);
      expect_opposite(push);
      on_a.force += push.on_a.force;
      on_a.torque += push.on_a.torque;
      rate += volume_rate(patches[k], pa, pb, motion_a, motion_b);
    }
    const Wrench whole_on_a = wrenches(whole, pb.pose, at_a, Vector3d::Zero()).on_a;
    EXPECT_LE((on_a.force - whole_on_a.force).norm(), 1e-13);
    EXPECT_LE((on_a.torque - whole_on_a.torque).norm(), 1e-12);
    EXPECT_NEAR(rate, volume_rate(whole, pa, pb, motion_a, motion_b), 1e-12 * (1 + scale));
  }
}

}  // namespace
}  // namespace ist
