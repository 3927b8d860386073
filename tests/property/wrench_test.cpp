#include <gtest/gtest.h>
#include <ist/field.h>
#include <ist/pose_eigen.h>
#include <ist/wrench.h>

#include <vector>

#include "support/random_assets.h"
#include "support/reference_sum.h"

namespace ist {
namespace {

using Eigen::Vector3d;
using testing::make_random_asset;
using testing::random_pose;

Pose moved(const Pose& pose, const Twist& motion, double time) {
  const Vector3d turn = motion.angular_velocity * time;
  Eigen::Isometry3d step = Eigen::Isometry3d::Identity();
  step.translate(motion.point + motion.velocity * time);
  step.rotate(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  step.translate(-motion.point);
  return to_pose(step * to_isometry(pose));
}

class Wrenching : public ::testing::Test {
 protected:
  Vector3d vector(double size) {
    std::uniform_real_distribution<double> uniform(-size, size);
    return testing::random_vector([&] { return uniform(random_); });
  }
  Twist twist() { return {vector(3), vector(1), vector(1)}; }

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
    const PlacedTree pa{a.view(), random_pose(random_, 0.5), 1.3};
    const PlacedTree pb{b.view(), random_pose(random_, 1), 0.9};
    const Penetration contact = penetration(pa, pb, {}, workspace_);
    if (contact.volume == 0) continue;
    ++met;
    const Twist twist_a = twist(), twist_b = twist();
    const auto volume = [&](double time) {
      return testing::reference_sum({pa.tree, moved(pa.pose, twist_a, time), pa.scale},
                                    {pb.tree, moved(pb.pose, twist_b, time), pb.scale},
                                    Measure::matched)
          .volume;
    };
    const double expected = (volume(kStep) - volume(-kStep)) / (2 * kStep);
    const double scale = contact.translation_gradient.norm() + contact.rotation_gradient.norm();
    EXPECT_NEAR(volume_rate(contact, pb.pose, twist_a, twist_b), expected, 2e-3 * scale);

    // Moving along together, nothing changes.
    Twist along = twist_a;
    along.point = twist_b.point;
    along.velocity += twist_a.angular_velocity.cross(along.point - twist_a.point);
    EXPECT_NEAR(volume_rate(contact, pb.pose, twist_a, along), 0, 1e-13 * 10 * scale);

    // The same force at another point is the same motion.
    const Vector3d point = vector(5);
    expect_opposite(wrenches(contact, pb.pose, point, point));
    const Wrench there = wrenches(contact, pb.pose, point, twist_b.point).on_b;
    const Wrench back = about(there, twist_b.point, point);
    EXPECT_LE((back.torque - wrenches(contact, pb.pose, point, point).on_b.torque).norm(),
              1e-14 * 10 * scale);
  }
  EXPECT_GT(met, 20);
}

TEST_F(Wrenching, OfFieldsAndOfPatches) {
  const Asset b = make_random_asset({200, 0.3, {}, 0}, 11);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 20; ++i) {
    const PlacedField pa{BoxField{Vector3d(3, 2, 1)}, random_pose(random_, 0.3)};
    const PlacedTree pb{b.view(), random_pose(random_, 1.5), 0.7};
    std::vector<ContactPatch> patches(6);
    const ContactPatches found = contact_patches(pa, pb, {}, workspace_, patches);
    ASSERT_GT(found.count, 0u);
    const Twist twist_a = twist(), twist_b = twist();
    const auto volume = [&](double time) {
      return penetration(PlacedField{pa.field, moved(pa.pose, twist_a, time)},
                         {pb.tree, moved(pb.pose, twist_b, time), pb.scale}, {}, workspace_)
          .volume;
    };
    const double expected = (volume(kStep) - volume(-kStep)) / (2 * kStep);
    const Penetration& whole = found.penetration;
    const double scale = whole.translation_gradient.norm() + whole.rotation_gradient.norm();
    EXPECT_NEAR(volume_rate(whole, pb.pose, twist_a, twist_b), expected, 1e-4 * (scale + 0.01));
    double rate = 0;
    Wrench on_a;
    for (std::size_t k = 0; k < found.count; ++k) {
      const Wrenches push = wrenches(patches[k], pb.pose, twist_a.point, twist_a.point);
      expect_opposite(push);
      on_a.force += push.on_a.force;
      on_a.torque += push.on_a.torque;
      rate += volume_rate(patches[k], pb.pose, twist_a, twist_b);
    }
    const Wrench whole_on_a = wrenches(whole, pb.pose, twist_a.point, Vector3d::Zero()).on_a;
    EXPECT_LE((on_a.force - whole_on_a.force).norm(), 1e-13);
    EXPECT_LE((on_a.torque - whole_on_a.torque).norm(), 1e-12);
    EXPECT_NEAR(rate, volume_rate(whole, pb.pose, twist_a, twist_b), 1e-12 * (1 + scale));
  }
}

}  // namespace
}  // namespace ist
