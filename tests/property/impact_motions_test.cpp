#include <gtest/gtest.h>
#include <ist/pose_eigen.h>
#include <ist/time_of_impact.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "query/impact/impact_side.h"
#include "query/impact/moving_frame.h"
#include "support/impact_bodies.h"

// The parts of times of impact: motions, and pairs of convex parts.

namespace ist {
namespace {

using namespace testing;

TEST(Motions, LeadFromPoseToPose) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 200; ++i) {
    const Pose from = random_pose(random, 2), to = random_pose(random, 3);
    const Vector3d about(0.3, -0.2, 0.7);
    const Motion motion = motion_between(from, to, 0.25, about, 2);
    EXPECT_LE(motion.angular_velocity.norm() * 0.25, std::numbers::pi + 1e-12);
    const Eigen::Isometry3d end = to_isometry(moved(from, motion, 0.25, 2));
    EXPECT_LE((end.matrix() - to_isometry(to).matrix()).norm(), 1e-13);
    // Half of the motion moves the point by half, and the rotation is the slerp.
    const Eigen::Isometry3d half = to_isometry(moved(from, motion, 0.125, 2));
    const Vector3d middle = (to_isometry(from) * (2 * about) + to_isometry(to) * (2 * about)) / 2;
    EXPECT_LE((half * Vector3d(2 * about) - middle).norm(), 1e-13);
    const Eigen::Quaterniond slerp = Eigen::Quaterniond(to_isometry(from).linear())
                                         .slerp(0.5, Eigen::Quaterniond(to_isometry(to).linear()));
    EXPECT_LE((half.linear() - slerp.toRotationMatrix()).norm(), 1e-12);
  }
  const Pose still = random_pose(random, 1);
  EXPECT_EQ(motion_between(still, still, 1).angular_velocity.norm(), 0);
}

TEST(Motions, TurnAsTheExponential) {
  for (const double h :
       {-std::numbers::pi / 2, -1.0, -1e-9, 0.0, 1e-5, 0.5, 1.2, std::numbers::pi / 2}) {
    EXPECT_NEAR(sine_cosine(h).sine, std::sin(h), 2e-16);
    EXPECT_NEAR(sine_cosine(h).cosine, std::cos(h), 3e-16);
  }
  for (const double time : {0.0, 0.3, 1.0, 17.0, 1000.0}) {
    const Vector3d spin(1, -2, 0.5);
    const Eigen::Matrix3d want =
        Eigen::AngleAxisd(spin.norm() * time, spin.normalized()).toRotationMatrix();
    const Eigen::Matrix3d got =
        Turning(Eigen::Quaterniond::Identity(), spin).at(time).toRotationMatrix();
    EXPECT_LE((want - got).norm(), 1e-14 * (1 + spin.norm() * time));
  }
}

TEST(ConvexPairs, NearestPointsAreNoFurtherThanAnySample) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto draw = [&] { return uniform(random); };
  int apart = 0;
  for (int i = 0; i < 300; ++i) {
    ConvexPiece a, b;
    a.corners = b.corners = 3;
    for (Vector3d& c : a.corner) c = random_vector(draw);
    for (Vector3d& c : b.corner) c = random_vector(draw) + Vector3d(0.01 * (i % 150), 0, 0);
    const NearestPoints found = nearest_points(a, b);
    EXPECT_NEAR((found.b - found.a).norm(), found.distance, 1e-15);
    EXPECT_LE((nearest_in_piece(a, found.a) - found.a).norm(), 1e-14);
    EXPECT_LE((nearest_in_piece(b, found.b) - found.b).norm(), 1e-14);
    if (triangles_cross(a, b)) continue;
    ++apart;
    // The plane between is the proof that nothing is nearer.
    if (found.distance > 1e-3) {
      const Vector3d n = (found.b - found.a) / found.distance;
      EXPECT_NEAR(apart_along(n, a, b), found.distance, 1e-12);
    }
    for (int s = 0; s < 200; ++s) {
      const auto point = [&](const ConvexPiece& t) -> Vector3d {
        const double u = std::abs(draw()), v = std::abs(draw()) * (1 - u);
        return u * t.corner[0] + v * t.corner[1] + (1 - u - v) * t.corner[2];
      };
      EXPECT_GE((point(b) - point(a)).norm(), found.distance - 1e-12);
    }
  }
  EXPECT_GT(apart, 100);
}

}  // namespace
}  // namespace ist
