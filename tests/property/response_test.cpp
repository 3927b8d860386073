#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/contact_law.h>
#include <ist/shapes.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "support/random_assets.h"
#include "support/surface_queries.h"
#include "support/test_meshes.h"

// The laws of response.h: what they give back is never more than what they took.

namespace ist {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using testing::baked;
using testing::cube;
using testing::pose_of;
using testing::torus;

/// A flat patch under B, pressed `depth` deep.
ContactPatch flat_patch(double area, double depth) {
  ContactPatch patch;
  patch.id = 7;
  patch.normal = Vector3d::UnitZ();
  patch.area = area;
  patch.depth = depth;
  patch.volume = area * depth;
  patch.force = area * patch.normal;
  return patch;
}

TEST(Response, AMassComesBackAtTheRestitutionAskedFor) {
  for (const double restitution : {0.9, 0.5, 0.2}) {
    constexpr double kSpeed = 3, kMass = 2, kArea = 0.5, kStep = 1e-6;
    ContactLaw law;
    law.stiffness = 4e4;
    law.damping = damping_for_restitution(restitution, kSpeed);
    ContactMemory memory;
    double depth = 0, speed = kSpeed;  // downward
    do {
      const ContactPatch patch = flat_patch(kArea, depth);
      const ContactForce contact =
          contact_force(law, {&patch, 1}, {{0, 0, -speed}}, Vector3d::Zero(), kStep, memory);
      EXPECT_GE(contact.force.z(), 0);
      speed -= kStep * contact.force.z() / kMass;
      depth += kStep * speed;
    } while (depth > 0);
    EXPECT_NEAR(-speed / kSpeed, restitution, 1e-3);
  }
  EXPECT_EQ(damping_for_restitution(1, 5), 0);
}

TEST(Response, SemiImplicitEulerHoldsUpToTheLargestStableStep) {
  for (const double damping : {0.0, 3.0, 40.0}) {
    constexpr double kStiffness = 700, kMass = 0.3;
    const double largest = largest_stable_step(kStiffness, damping, kMass);
    for (const double share : {0.999, 1.001}) {
      double x = 1, v = 0, worst = 0;
      for (int i = 0; i < 20000 && worst < 1000; ++i) {
        v += share * largest * (-kStiffness * x - damping * v) / kMass;
        x += share * largest * v;
        worst = std::max(worst, std::abs(x));
      }
      EXPECT_EQ(worst < 100, share < 1) << damping << " " << worst;
    }
  }
  EXPECT_NEAR(largest_stable_step(largest_stable_stiffness(0.01, 5), 0, 5), 0.01, 1e-15);
}

TEST(Response, TheEffectiveMassIsWhatAnImpulseMeets) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto draw = [&] { return uniform(random); };
  for (int i = 0; i < 100; ++i) {
    std::array<ContactBody, 2> bodies;
    for (ContactBody& body : bodies) {
      Eigen::Matrix3d m;
      for (int k = 0; k < 9; ++k) m.data()[k] = draw();
      body = {1.5 + draw(), m * m.transpose() + Eigen::Matrix3d::Identity(),
              testing::random_vector(draw)};
    }
    const Vector3d point = testing::random_vector(draw);
    const Vector3d n = testing::random_vector(draw).normalized();
    double apart = 0;  // speed at which an impulse of 1 along n parts the two at the point
    for (const ContactBody& body : bodies) {
      const Vector3d arm = point - body.centre_of_mass;
      apart += (body.inverse_mass * n + (body.inverse_inertia * arm.cross(n)).cross(arm)).dot(n);
    }
    EXPECT_NEAR(effective_mass(bodies[0], bodies[1], point, n) * apart, 1, 1e-12);
  }
  EXPECT_TRUE(std::isinf(effective_mass({}, {}, Vector3d::Zero(), Vector3d::UnitX())));
}

TEST(Response, StiffnessRestsWhereItWasAskedTo) {
  const ContactPatch patch = flat_patch(0.4, 0.02);
  ContactLaw law;
  law.stiffness = stiffness_for_depth(12, 0.4, 0.02);
  ContactMemory memory;
  EXPECT_NEAR(contact_force(law, {&patch, 1}, {}, Vector3d::Zero(), 1e-3, memory).force.z(), 12,
              1e-12);
  EXPECT_NEAR(stiffness_of_layer(3, 0, 0.5), 6, 1e-15);  // a bar where nothing moves sideways
  EXPECT_NEAR(stiffness_in_series(6, 3), 2, 1e-15);
}

// Friction alone: at every step the work that it gives and what its springs hold is no more than
// what they held before, whatever the path, the limit, the area and the normal do.
TEST(Response, FrictionNeverGivesMoreThanItHolds) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto draw = [&] { return uniform(random); };
  ContactLaw law;
  law.stiffness = 1000;
  law.friction = 0.6;
  law.friction_stiffness = 500;
  for (const double damping : {0.0, 2.0}) {
    law.friction_damping = damping;
    ContactMemory memory, other;
    double held = 0, slid = 0, stuck = 0, most = 0;
    for (int i = 0; i < 100000; ++i) {
      constexpr double kStep = 1e-3;
      ContactPatch patch = flat_patch(1 + 0.5 * std::sin(0.01 * i), 0.01 + 0.009 * draw());
      patch.normal = (Vector3d::UnitZ() + 0.2 * testing::random_vector(draw)).normalized();
      patch.force = patch.area * patch.normal;
      patch.centroid = testing::random_vector(draw);
      const Vector3d origin = testing::random_vector(draw);
      Motion motion{10 * testing::random_vector(draw), testing::random_vector(draw)};
      const ContactForce with = contact_force(law, {&patch, 1}, motion, origin, kStep, memory);
      ContactLaw smooth = law;
      smooth.friction = 0;
      const ContactForce without = contact_force(smooth, {&patch, 1}, motion, origin, kStep, other);
      const Vector3d force = with.force - without.force;
      const Vector3d torque = with.torque - without.torque;
      const double limit = law.friction * with.normal_force;
      EXPECT_LE(force.norm(), limit * (1 + 1e-12));
      EXPECT_LE(std::abs(force.dot(patch.normal)), 1e-10);
      (force.norm() > limit * (1 - 1e-9) ? slid : stuck) += 1;
      const double now = with.energy - without.energy;
      const double given =
          kStep * (force.dot(motion.velocity) + torque.dot(motion.angular_velocity));
      EXPECT_LE(given + now, held + 1e-9) << i;
      held = now;
      most = std::max(most, held);
    }
    EXPECT_GT(slid, 1000);
    EXPECT_GT(stuck, 1000);
    EXPECT_GT(most, 1e-3);
  }
}

/// B's pose on a closed path through a contact, s in [0, 1).
struct Path {
  Vector3d centre, amplitude;
  Vector3d turn;  ///< [rad]
  Pose at(double s) const {
    const double a = 2 * std::numbers::pi * s;
    const Vector3d t =
        centre + amplitude.cwiseProduct(Vector3d(std::sin(a), std::sin(2 * a + 1), std::cos(a)));
    const Vector3d r = turn * std::sin(a + 0.5);
    const double angle = r.norm();
    return pose_of(
        Quaterniond(Eigen::AngleAxisd(angle, angle > 0 ? Vector3d(r / angle) : Vector3d::UnitX())),
        t);
  }
};

struct Cycle {
  double work = 0;  ///< [force·u] given to the bodies over one cycle
  double most = 0;  ///< [force·u] held by the springs where they hold most
};

/// The work of the law along the closed path, by the trapezoidal rule over `steps` steps of 1/steps
/// s.
template <class Placed>
Cycle go_round(const ContactLaw& law, const Placed& a, const AssetView& tree, const Path& path,
               int steps, std::size_t patch_count, ContactMemory& memory) {
  Workspace workspace;
  std::vector<ContactPatch> patches(patch_count);
  Cycle cycle;
  ContactForce last;
  Motion last_motion;
  const double step = 1.0 / steps;
  const auto motion_at = [&](double s) {
    constexpr double kHalf = 1e-6;
    const Pose before = path.at(s - kHalf), after = path.at(s + kHalf);
    const Quaterniond q0(before.q[0], before.q[1], before.q[2], before.q[3]);
    const Quaterniond q1(after.q[0], after.q[1], after.q[2], after.q[3]);
    const Eigen::AngleAxisd turn(q1 * q0.conjugate());
    return Motion{(Vector3d(after.t) - Vector3d(before.t)) / (2 * kHalf),
                  turn.axis() * turn.angle() / (2 * kHalf)};
  };
  for (int i = 0; i <= steps; ++i) {
    const double s = i * step;
    const Pose pose = path.at(s);
    const ContactPatches found = contact_patches(a, {tree, pose}, {}, workspace, patches);
    const Motion motion = motion_at(s);
    const ContactForce now = contact_force(law, std::span(patches).first(found.count), motion,
                                           Vector3d(pose.t), step, memory);
    const auto power = [](const ContactForce& f, const Motion& m) {
      return f.force.dot(m.velocity) + f.torque.dot(m.angular_velocity);
    };
    if (i > 0) cycle.work += 0.5 * step * (power(last, last_motion) + power(now, motion));
    cycle.most = std::max(cycle.most, now.energy);
    last = now;
    last_motion = motion;
  }
  return cycle;
}

struct Loop {
  const char* name;
  Path path;
};

const std::array<Loop, 4> kOnPlane = {
    Loop{"up and down", {{0, 0, 0.48}, {0.02, 0, 0.03}, {0, 0, 0}}},
    Loop{"rocking", {{0, 0, 0.49}, {0, 0, 0}, {0.05, 0.03, 0}}},
    Loop{"all at once", {{0, 0, 0.5}, {0.1, 0.1, 0.03}, {0.1, 0.05, 0.3}}},
    Loop{"apart and together", {{0, 0, 0.56}, {0.1, 0, 0.1}, {0.3, 0.1, 0}}},
};
const std::array<Loop, 3> kOnCube = {
    Loop{"face", {{0, 0, 0.62}, {0.1, 0.1, 0.04}, {0.2, 0.1, 0.3}}},
    Loop{"edge", {{0.5, 0, 0.5}, {0.1, 0.1, 0.1}, {0.4, 0.4, 0.4}}},
    Loop{"through the ring", {{0.65, 0.45, 0.2}, {0.1, 0.1, 0.1}, {0.4, 0.4, 0.4}}},
};

// One patch and an area of reference: a potential. What is left is the quadrature's, and falls with
// its steps.
TEST(Response, APotentialKeepsEnergyRoundEveryLoop) {
  ContactLaw law;
  law.stiffness = 1000;
  law.area = 0.3;
  const auto expect_none = [&](const auto& a, const AssetView& tree, const Loop& loop) {
    ContactMemory memory;
    const Cycle cycle = go_round(law, a, tree, loop.path, 4000, 1, memory);
    EXPECT_GT(cycle.most, 1e-2) << loop.name;
    EXPECT_LT(std::abs(cycle.work), 2e-4 * cycle.most) << loop.name;
  };
  for (const Loop& loop : kOnPlane) {
    expect_none(PlacedShape{HalfSpaceShape{}, {}}, cube().view(), loop);
  }
  for (const Loop& loop : kOnCube)
    expect_none(PlacedAsset{cube().view(), {}}, torus().view(), loop);
}

// Patches with areas of their own lose where areas change; what they give where a contact is
// divided anew is little.
TEST(Response, PatchesGiveNextToNothingRoundALoop) {
  const auto expect_none = [](const auto& a, const AssetView& tree, const Loop& loop) {
    for (const std::size_t patches : {1u, 8u, 32u}) {
      for (const double damping : {0.0, 1.0}) {
        ContactLaw law;
        law.stiffness = 1000;
        law.damping = damping;
        ContactMemory memory;
        go_round(law, a, tree, loop.path, 400, patches, memory);
        const Cycle cycle = go_round(law, a, tree, loop.path, 2000, patches, memory);
        EXPECT_LT(cycle.work, (damping > 0 ? 0 : 0.01) * cycle.most)
            << loop.name << ", " << patches << " patches, damping " << damping;
      }
    }
  };
  for (const Loop& loop : kOnPlane) {
    expect_none(PlacedShape{HalfSpaceShape{}, {}}, cube().view(), loop);
  }
  for (const Loop& loop : kOnCube)
    expect_none(PlacedAsset{cube().view(), {}}, torus().view(), loop);
}

}  // namespace
}  // namespace ist
