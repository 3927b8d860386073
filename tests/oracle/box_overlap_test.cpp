#include "support/box_overlap.h"

#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/pose_eigen.h>
#include <ist/query.h>

#include <algorithm>
#include <random>
#include <vector>

#include "support/test_meshes.h"

namespace ist {
namespace {

using testing::OrientedBox;
using testing::overlap_volume;

const Eigen::Vector3d kHalfA(0.5, 0.4, 0.3);
const Eigen::Vector3d kHalfB(0.3, 0.5, 0.6);

Asset bake_box(const Eigen::Vector3d& half, std::size_t spheres) {
  PackingSettings settings;
  settings.max_spheres = spheres;
  return bake(close_mesh(testing::box_mesh(-half, half), "box"), settings);
}

OrientedBox moved(const Eigen::Vector3d& half, const Eigen::Isometry3d& pose) {
  return {pose.translation(), half, pose.linear()};
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<long>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

TEST(BoxOverlap, ClippingKnowsWhatCanBeToldByHand) {
  const OrientedBox a{Eigen::Vector3d::Zero(), kHalfA, Eigen::Matrix3d::Identity()};
  OrientedBox b = a;
  EXPECT_NEAR(overlap_volume(a, b), 8 * kHalfA.prod(), 1e-15);
  b.centre.x() = 0.75;
  EXPECT_NEAR(overlap_volume(a, b), 0.25 * 0.8 * 0.6, 1e-15);
  b.centre.x() = 1.01;
  EXPECT_EQ(overlap_volume(a, b), 0);
  // Two unit cubes, one turned by 45° about z: a regular octagon of inner radius ½ times 1.
  const OrientedBox cube{Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.5),
                         Eigen::Matrix3d::Identity()};
  OrientedBox turned = cube;
  turned.axes = Eigen::AngleAxisd(M_PI / 4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_NEAR(overlap_volume(cube, turned), 2 * (std::sqrt(2.0) - 1), 1e-15);
}

TEST(BoxOverlap, VolumesGradientsAndTheLowerBound) {
  const Asset a = bake_box(kHalfA, 1500), b = bake_box(kHalfB, 1500);
  const double smaller = 8 * std::min(kHalfA.prod(), kHalfB.prod());
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  Workspace workspace;
  std::vector<double> deep, shallow, force;
  while (deep.size() < 60 || shallow.size() < 60) {
    const Eigen::Quaterniond q(unit(random), unit(random), unit(random), unit(random));
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = q.normalized().toRotationMatrix();
    pose.translation() = Eigen::Vector3d(unit(random), unit(random), unit(random));
    const OrientedBox box_a{Eigen::Vector3d::Zero(), kHalfA, Eigen::Matrix3d::Identity()};
    const double exact = overlap_volume(box_a, moved(kHalfB, pose));
    if (exact < 1e-3 * smaller) continue;
    const PlacedAsset placed_a{a.view(), Pose{}}, placed_b{b.view(), to_pose(pose)};
    const Penetration matched = penetration(placed_a, placed_b, {}, workspace);
    ASSERT_EQ(matched.status, QueryStatus::ok);
    (exact > 0.1 * smaller ? deep : shallow).push_back(std::abs(matched.volume / exact - 1));

    PenetrationSettings inner;
    inner.measure = Measure::inner;
    EXPECT_LE(penetration(placed_a, placed_b, inner, workspace).volume_min, exact * (1 + 1e-9));

    // Central differences of the exact volume: its error falls with the square of the step.
    Eigen::Vector3d gradient;
    for (int k = 0; k < 3; ++k) {
      constexpr double kStep = 1e-5;
      Eigen::Isometry3d ahead = pose, behind = pose;
      ahead.translation()[k] += kStep;
      behind.translation()[k] -= kStep;
      gradient[k] = (overlap_volume(box_a, moved(kHalfB, ahead)) -
                     overlap_volume(box_a, moved(kHalfB, behind))) /
                    (2 * kStep);
    }
    if (exact < 0.5 * smaller) force.push_back((matched.force + gradient).norm() / gradient.norm());
  }
  EXPECT_LE(median(deep), 0.001);
  EXPECT_LE(median(shallow), 0.005);
  EXPECT_LE(median(force), 0.03);
  RecordProperty("deep", std::to_string(median(deep)));
  RecordProperty("shallow", std::to_string(median(shallow)));
  RecordProperty("force", std::to_string(median(force)));
}

}  // namespace
}  // namespace ist
