#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <ist/query.h>

#include "query/shape/plain_shapes.h"
#include "support/box_overlap.h"
#include "support/reference_sum.h"
#include "support/surface_queries.h"

// Sums of queries of fields and trees, and of two trees of unlike sizes, where meshes answer:
// closed forms, gradients, energy, nothing that jumps.

namespace ist {
namespace {

using namespace testing;

/// The volume changes by what its gradients say, along short motions in all directions. `rounding`:
/// relative, of a volume.
void expect_gradients(const char* name, const Ask& ask, const Pose& pose, double length,
                      double rounding, std::mt19937_64& random) {
  for (int kind = 0; kind < 3; ++kind) {
    Sweep motion{pose};
    if (kind != 1) motion.v = length * random_direction(random);
    if (kind != 0) motion.w = 2 * length * random_direction(random);
    const Work work = work_of(ask, motion, 40);
    // Simpson's rule meets kinks of the force wherever a ball begins to touch; torques may cancel.
    const double slack = 1e-3 * work.moved + 1e-6 * length * std::pow(work.most, 2.0 / 3);
    EXPECT_NEAR(work.done, work.change, slack + rounding * work.most) << name
                                                                      << (kind == 0   ? " along"
                                                                          : kind == 1 ? " about"
                                                                                      : " both")
                                                                      << ", volume " << work.most;
  }
}

TEST(FieldQuery, GradientsAreThoseOfTheVolume) {
  Workspace workspace;
  std::mt19937_64 random(21);
  for (const auto& [name, field] : fields()) {
    const PlacedShape a{field, random_pose(random, 0.3), 1.3};
    for (int i = 0; i < 6; ++i) {
      const Asset& body = i % 2 == 0 ? cube() : torus();
      const double scale = i < 3 ? 0.4 : 0.9;
      Pose pose = random_pose(random, 0.5);
      for (int k = 0; k < 3; ++k) pose.t[k] += a.pose.t[k];
      const Ask ask = [&](const Pose& p) {
        return penetration(a, {body.view(), p, scale}, {}, workspace);
      };
      expect_gradients(name, ask, pose, 0.02, 1e-12, random);
    }
  }
}

/// The gradients of the other order are those by a motion of the field.
TEST(FieldQuery, EitherMayBeTheSecond) {
  Workspace workspace;
  std::mt19937_64 random(24);
  std::vector<ContactPatch> patches(6), turned(6);
  for (const auto& [name, field] : fields()) {
    const PlacedAsset body{cube().view(), random_pose(random, 0.3), 0.6};
    Pose pose = random_pose(random, 0.4);
    for (int k = 0; k < 3; ++k) pose.t[k] += body.pose.t[k];
    const Ask ask = [&](const Pose& p) {
      return penetration(body, PlacedShape{field, p, 1.3}, {}, workspace);
    };
    expect_gradients(name, ask, pose, 0.02, 1e-12, random);

    const PlacedShape still{field, pose, 1.3};
    const ContactPatches one = contact_patches(still, body, {}, workspace, patches);
    const ContactPatches other = contact_patches(body, still, {}, workspace, turned);
    ASSERT_EQ(one.count, other.count) << name;
    EXPECT_EQ(one.penetration.volume, other.penetration.volume);
    Eigen::Vector3d force = Eigen::Vector3d::Zero(), torque = force;
    for (std::size_t i = 0; i < one.count; ++i) {
      EXPECT_EQ(patches[i].id, turned[i].id);
      EXPECT_EQ(patches[i].normal, -turned[i].normal);
      force += turned[i].force;
      torque += turned[i].torque;
    }
    const double scale = force.norm() + torque.norm() + 1e-12;
    EXPECT_LT((force - other.penetration.force).norm(), 1e-12 * scale) << name;
    EXPECT_LT((torque - other.penetration.torque).norm(), 1e-12 * scale) << name;

    PlacedAsset away = body;
    away.pose.t[2] += 9;
    const Separation gap = separation(still, away, {}, workspace);
    const Separation back = separation(away, still, {}, workspace);
    EXPECT_EQ(gap.distance, back.distance);
    EXPECT_EQ(gap.point_a, back.point_b);
    EXPECT_EQ(gap.normal, -back.normal);
    EXPECT_EQ(overlap(still, away, workspace).answer, overlap(away, still, workspace).answer);
  }
}

TEST(FieldQuery, TwoFieldsHoldNoSpheres) {
  Workspace workspace;
  ContactPatch patch;
  const PlacedSolid box(BoxShape{}, Pose{}), ball(BallShape{}, Pose{});
  const Penetration found = penetration(box, ball, {}, workspace);
  EXPECT_EQ(found.status, QueryStatus::missing_data);
  EXPECT_TRUE(std::isnan(found.volume));
  EXPECT_EQ(separation(box, ball, {}, workspace).status, QueryStatus::missing_data);
  EXPECT_EQ(contact_patches(box, ball, {}, workspace, {&patch, 1}).count, 0u);
  EXPECT_EQ(overlap(box, ball, workspace), YesNo::unknown);
}

TEST(FieldQuery, CylindersRimIsMetByEveryBall) {
  // Past the rim a ball is beside the mantle and above the end, and has a part of either: nodes may
  // not be left out by their distance to the rim.
  Workspace workspace;
  const Asset one = make_random_asset({300, 0.3, {}, 0}, 5);
  const PlacedShape a{CylinderShape{0.4, 0.3}, {}, 1};
  std::mt19937_64 random(31);
  std::uniform_real_distribution<double> uniform(0, 0.5);
  for (int i = 0; i < 400; ++i) {
    Pose pose = random_pose(random, 0);
    pose.t[0] = 0.4 + uniform(random), pose.t[2] = 0.3 + uniform(random);
    const PlacedAsset b{one.view(), pose, 0.5};
    double want = 0;
    for (const WorldSphere& s : world_spheres(b, Measure::matched)) {
      const double whole = 4 * std::numbers::pi / 3 * s.r * s.r * s.r;
      const double slab =
          cap(s.r, 0.3 - s.centre.z()).volume + cap(s.r, 0.3 + s.centre.z()).volume - whole;
      want += cap(s.r, 0.4 - s.centre.head<2>().norm()).volume * std::max(0.0, slab) / whole;
    }
    EXPECT_NEAR(penetration(a, b, {}, workspace).volume, want, 1e-9 * want + 1e-15);
  }
}

TEST(UnlikePairs, GradientsAreThoseOfTheVolume) {
  Workspace workspace;
  std::mt19937_64 random(22);
  for (const SurfacePair& pair : pairs()) {
    int met = 0;
    for (int i = 0; i < 8; ++i) {
      const PlacedAsset a{pair.a.view(), random_pose(random, 0.3), 1.2};
      Pose pose = random_pose(random, 1.2 * pair.distance);
      for (int k = 0; k < 3; ++k) pose.t[k] += a.pose.t[k];
      const Ask ask = [&](const Pose& p) {
        return penetration(a, {pair.b.view(), p, 1.2 * pair.scale_b}, {}, workspace);
      };
      met += ask(pose).volume > 0 ? 1 : 0;
      // Lenses are summed in float, to 1e-6.
      expect_gradients(pair.name, ask, pose, 0.02 * std::min(1.0, pair.scale_b), 2e-6, random);
    }
    EXPECT_GT(met, 1) << pair.name;
  }
}

TEST(UnlikePairs, AnswersAreSound) {
  Workspace workspace;
  std::mt19937_64 random(23);
  for (const SurfacePair& pair : pairs()) {
    for (const bool spheres_only : {false, true}) {
      for (int i = 0; i < 20; ++i) {
        const PenetrationSettings settings = {.spheres_only = spheres_only};
        const PlacedAsset a{pair.a.view(), random_pose(random, 0.3), 1.2};
        const PlacedAsset b{pair.b.view(), random_pose(random, 1.2 * pair.distance),
                            1.2 * pair.scale_b};
        const Penetration ab = penetration(a, b, settings, workspace);
        const Penetration ba = penetration(b, a, settings, workspace);
        EXPECT_EQ(ab.status, QueryStatus::ok);
        EXPECT_LE(ab.volume_min, ab.volume);
        EXPECT_GE(ab.volume_max, ab.volume);
        EXPECT_LE(ab.volume_min, ba.volume * (1 + 1e-5));
        EXPECT_NEAR(ab.volume, ba.volume, 1e-5 * ab.volume) << pair.name;
        const double force = ab.force.norm() + std::pow(ab.volume, 2.0 / 3);
        EXPECT_LE((ab.force + ba.force).norm(), 1e-4 * force) << pair.name;
        const Vector3d torque_a = ba.torque + position(a.pose).cross(ba.force);
        const Vector3d torque_b = ab.torque + position(b.pose).cross(ab.force);
        EXPECT_LE((torque_a + torque_b).norm(), 1e-4 * force * 2) << pair.name;
        if (!(ab.volume > 0)) continue;
        EXPECT_LE((ab.centroid - ba.centroid).norm(), 1e-4) << pair.name;
        // Within both bodies' bounding balls, protruding spheres included.
        EXPECT_LE((ab.centroid - position(a.pose)).norm(), 1.2 * 1.5);
        EXPECT_LE((ab.centroid - position(b.pose)).norm(), 1.2 * pair.scale_b * 1.5);
      }
    }
  }
}

// Work along a closed path that goes from a light touch to deep contact and back: none, and over
// its first half what the volume changed.
TEST(UnlikePairs, EnergyIsConservedOverClosedLoops) {
  Workspace workspace;
  for (const bool swapped : {false, true}) {
    const PlacedAsset fixed{cube().view(), {}, 1};
    const Vector3d axis = Vector3d(0.3, -0.5, 0.8).normalized();
    const auto pose = [&](double phase) {
      const double turn = 2 * std::numbers::pi * phase;
      return pose_of(Quaterniond(Eigen::AngleAxisd(turn, axis)),
                     {0.75 + 0.25 * std::cos(turn), 0.2 * std::sin(turn), 0.1});
    };
    const auto ask = [&](double phase) {
      const PlacedAsset moving{torus().view(), pose(phase), 0.9};
      if (!swapped) return penetration(fixed, moving, {}, workspace);
      Penetration p = penetration(moving, fixed, {}, workspace);
      p.torque = -(p.torque - position(moving.pose).cross(p.force));
      p.force = -p.force;
      return p;
    };
    const auto power = [&](double phase) {
      const double turn = 2 * std::numbers::pi * phase;
      const Penetration p = ask(phase);
      const Vector3d v(-0.25 * std::sin(turn), 0.2 * std::cos(turn), 0);
      return -2 * std::numbers::pi * (p.force.dot(v) + p.torque.dot(axis));
    };
    constexpr int kSteps = 6000;  // forces have kinks where balls touch
    double work = 0, half = 0, moved = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double from = double(i) / kSteps, to = double(i + 1) / kSteps;
      const double part = (power(from) + 4 * power((from + to) / 2) + power(to)) / (6 * kSteps);
      work += part;
      moved += std::abs(part);
      if (2 * (i + 1) == kSteps) half = work;
    }
    const double light = ask(0).volume, deep = ask(0.5).volume;
    ASSERT_GT(deep, 4 * light);
    EXPECT_NEAR(half, deep - light, 1e-5 * moved) << swapped;
    EXPECT_NEAR(work, 0, 1e-5 * moved) << swapped;
  }
}

// A cube carried through a wall, turned or not: its overlap is known exactly.
TEST(UnlikePairs, CarriedThroughAWall) {
  Workspace workspace;
  // Slab and cube are alike, so that lenses would answer where they are deep in each other.
  const PenetrationSettings exact = {.measure = Measure::exact};
  const Quaterniond turns[] = {Quaterniond::Identity(),
                               Quaterniond(0.9, 0.2, -0.3, 0.1).normalized()};
  for (const bool thin : {true, false}) {
    const double half = thin ? 0.01 : 0.2;
    for (const Quaterniond& q : turns) {
      for (const int order : {0, 1, 2}) {  // the wall as a field, as A, as B
        double last = 0, worst_jump = 0, error = 0, most = 0;
        constexpr int kSteps = 400;
        for (int i = 0; i <= kSteps; ++i) {
          const double z = -0.7 + 1.4 * i / kSteps;
          const PlacedAsset body{cube().view(), pose_of(q, {0.05, -0.1, z}), 0.5};
          const PlacedAsset wall{(thin ? plate() : slab()).view(), {}, 1};
          const Penetration got =
              order == 0
                  ? penetration(PlacedShape{BoxShape{{1, 1, half}}, {}, 1}, body, {}, workspace)
              : order == 1 ? penetration(wall, body, exact, workspace)
                           : penetration(body, wall, exact, workspace);
          const double want =
              overlap_volume({Vector3d::Zero(), {1, 1, half}, Eigen::Matrix3d::Identity()},
                             {{0.05, -0.1, z}, Vector3d::Constant(0.25), q.toRotationMatrix()});
          most = std::max(most, want);
          error = std::max(error, std::abs(got.volume - want));
          if (i > 0) worst_jump = std::max(worst_jump, std::abs(got.volume - last));
          last = got.volume;
        }
        std::printf("%s wall, order %d: worst error %.3f of the most\n", thin ? "thin" : "thick",
                    order, error / most);
        // A section of the cube is no larger than √3 · side² (turned); the balls that represent it
        // have sections some tenths larger where their layers are.
        EXPECT_LE(worst_jump, 1.5 * std::sqrt(3.0) * 0.25 * 1.4 / kSteps) << thin << ' ' << order;
        // Balls of a layer cross a thin wall together: the error is that of the cube's own faces.
        EXPECT_LE(error, (order > 0 ? 1e-12 : thin ? 0.08 : 0.01) * most) << thin << ' ' << order;
      }
    }
  }
}

// B ever smaller at the same place: its overlap in its own measure changes by little from size to
// size, whichever method answers.
TEST(UnlikePairs, NoJumpWhereMethodsChangeHands) {
  Workspace workspace;
  const Quaterniond q = Quaterniond(0.8, 0.3, -0.2, 0.4).normalized();
  for (const bool swapped : {false, true}) {
    for (const double depth : {0.05, 0.2, 0.5}) {
      double last = 0, worst = 0, at = 0, last_force = 0, worst_force = 0;
      for (double scale = 1; scale > 1e-6; scale *= scale > 0.01 ? 0.995 : 0.9) {
        // B's lowest corner, `depth` of its size below A's top.
        double low = 0;
        for (int i = 0; i < 8; ++i)
          low =
              std::min(low, (q * Vector3d((i & 1) - 0.5, (i >> 1 & 1) - 0.5, (i >> 2) - 0.5)).z());
        const PlacedAsset a{cube().view(), {}, 1};
        const PlacedAsset b{cube().view(), pose_of(q, {0.03, -0.05, 0.5 - scale * (low + depth)}),
                            scale};
        const Penetration p =
            swapped ? penetration(b, a, {}, workspace) : penetration(a, b, {}, workspace);
        const double share = p.volume / (scale * scale * scale);
        const double force = p.force.norm() / (scale * scale);
        if (last > 0) {
          const double step = std::abs(share / last - 1);
          if (step > worst) worst = step, at = scale;
          worst_force = std::max(worst_force, std::abs(force / last_force - 1));
        }
        last = share, last_force = force;
      }
      std::printf("depth %.2f%s: worst step %.3f at scale %.3g, of the force %.3f\n", depth,
                  swapped ? " swapped" : "", worst, at, worst_force);
      EXPECT_LE(worst, 0.06) << depth << ' ' << at;
      EXPECT_LE(worst_force, 0.12) << depth;
    }
  }
}

TEST(FieldQuery, HalfSpaceIsASumOfCaps) {
  Workspace workspace;
  std::mt19937_64 random(24);
  const Asset off = make_random_asset({500, 0.1, {3, -2, 1}, 2}, 6);
  for (int i = 0; i < 60; ++i) {
    const double scale = std::pow(10.0, i % 7 - 3);
    const Vector3d normal = random_direction(random);
    const PlacedShape a{HalfSpaceShape{normal, 0.1 * scale}, random_pose(random, scale), 0.7};
    const PlacedAsset b{(i % 2 == 0 ? off : cube()).view(), random_pose(random, 0.5 * scale),
                        scale};
    const Vector3d n = rotation(a.pose) * normal;
    double volume = 0, scale_of_force = 0;
    Vector3d force = Vector3d::Zero(), torque = force, moment = force;
    for (const WorldSphere& s : world_spheres(b, Measure::matched)) {
      const double d = 0.07 * scale - n.dot(s.centre - position(a.pose));
      const Cap c = cap(s.r, d);
      volume += c.volume;
      force += c.derivative * n;
      scale_of_force += c.derivative;
      torque += (s.centre - position(b.pose)).cross(c.derivative * n);
      moment += c.volume * s.centre - c.moment * n;
    }
    const Penetration p = penetration(a, b, {}, workspace);
    ASSERT_EQ(p.status, QueryStatus::ok);
    const double lever = 20 * scale;  // the farthest sphere
    EXPECT_NEAR(p.volume, volume, 1e-12 * volume + 1e-12 * scale * scale_of_force);
    EXPECT_LE((p.force - force).norm(), 1e-11 * scale_of_force);
    EXPECT_LE((p.torque - torque).norm(), 1e-11 * scale_of_force * lever);
    if (volume > 1e-6 * scale * scale * scale) {
      EXPECT_LE((p.centroid - moment / volume).norm(), 1e-9 * lever);
    }
    EXPECT_LE(p.volume_min, volume * (1 + 1e-12));
    EXPECT_GE(p.volume_max, volume * (1 - 1e-12));
  }
}

}  // namespace
}  // namespace ist
