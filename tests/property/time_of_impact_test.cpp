#include <gtest/gtest.h>
#include <ist/time_of_impact.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "support/impact_bodies.h"
#include "support/random_pairs.h"

// Times of impact against closed forms, against all pairs of triangles at many times of the motion,
// and at speeds at which no step would find the wall.

namespace ist {
namespace {

using namespace testing;

TEST(TimeOfImpact, OfACubeThatFallsOnAPlane) {
  const PlacedShape floor{HalfSpaceShape{}, {}, 1};
  for (const double speed : {1e-3, 1.0, 1e3}) {
    ImpactSettings settings;
    settings.duration = 10 / speed;
    settings.tolerance = 1e-3;
    const TimeOfImpact found =
        time_of_impact(floor, {cube().view(), at({0.3, 0.2, 2.5}), 1},
                       {{}, straight({0, 0, -speed})}, settings, workspace());
    EXPECT_EQ(found.kind, ImpactKind::impact);
    EXPECT_GE(found.time * speed, 2 - 1e-3);
    EXPECT_LE(found.time * speed, 2 - 0.5e-3 + 1e-6);
    EXPECT_GE(found.distance_min, 0.49e-3);
    EXPECT_LE(found.distance_max, 1e-3);
    EXPECT_LE((found.normal - Vector3d::UnitZ()).norm(), 1e-12);
    EXPECT_NEAR(found.point_b.z(), 2 - found.time * speed, 1e-6);
    EXPECT_NEAR(found.point_a.z(), 0, 1e-6);
    const TimeOfImpact turned =
        time_of_impact({cube().view(), at({0.3, 0.2, 2.5}), 1}, floor,
                       {straight({0, 0, -speed}), {}}, settings, workspace());
    EXPECT_EQ(turned.time, found.time);
    EXPECT_EQ(turned.point_a, found.point_b);
    EXPECT_EQ(turned.point_b, found.point_a);
    EXPECT_EQ(turned.normal, -found.normal);
  }
  EXPECT_EQ(time_of_impact(floor, floor, {}, {}, workspace()).status, QueryStatus::missing_data);
}

TEST(TimeOfImpact, OfASpinningRodAndAWall) {
  // The rod turns about its middle, d before the wall: cos θ + 0.05 sin θ = d, with x and z
  // swapped.
  for (const double d : {0.3, 0.7, 0.95}) {
    double low = 0, high = std::numbers::pi / 2;
    for (int i = 0; i < 100; ++i) {
      const double middle = (low + high) / 2;
      (std::sin(middle) + 0.05 * std::cos(middle) < d ? low : high) = middle;
    }
    ImpactSettings settings;
    settings.duration = 100;
    settings.tolerance = 1e-4;
    const Motion spin{Vector3d::Zero(), {0, -0.5, 0}, Vector3d::Zero()};
    const TimeOfImpact field =
        time_of_impact(PlacedShape{HalfSpaceShape{}, {}, 1}, {rod().view(), at({0, 0, d}), 1},
                       {{}, spin}, settings, workspace());
    const TimeOfImpact tree =
        time_of_impact(PlacedAsset{wall().view(), at({0, 0, -1}), 1},
                       {rod().view(), at({0, 0, d}), 1}, {{}, spin}, settings, workspace());
    const TimeOfImpact box =
        time_of_impact(PlacedShape{BoxShape{{9, 9, 1}}, at({0, 0, -1}), 1},
                       {rod().view(), at({0, 0, d}), 1}, {{}, spin}, settings, workspace());
    // Seen from the rod the wall goes round it.
    const TimeOfImpact around = time_of_impact(
        PlacedAsset{wall().view(), at({0, 0, -1}), 1}, {rod().view(), at({0, 0, d}), 1},
        {{Vector3d::Zero(), {0, 0.5, 0}, {0, 0, 1 + d}}, {}}, settings, workspace());
    const TimeOfImpact field_around =
        time_of_impact(PlacedShape{HalfSpaceShape{}, {}, 1}, {rod().view(), at({0, 0, d}), 1},
                       {{Vector3d::Zero(), {0, 0.5, 0}, {0, 0, d}}, {}}, settings, workspace());
    for (const TimeOfImpact& found : {field, tree, box, around, field_around}) {
      EXPECT_EQ(found.kind, ImpactKind::impact);
      EXPECT_LE(found.time, 2 * low);
      EXPECT_GE(found.time, 2 * low - 2 * 1.1e-4 / std::cos(low));
    }
  }
  // Just out of reach, for a hundred thousand turns.
  ImpactSettings settings;
  settings.duration = 1e5 * 2 * std::numbers::pi;
  settings.tolerance = 1e-4;
  const TimeOfImpact clear =
      time_of_impact(PlacedShape{HalfSpaceShape{}, {}, 1}, {rod().view(), at({0, 0, 1.01}), 1},
                     {{}, {Vector3d::Zero(), {0, 0, 1}, Vector3d::Zero()}}, settings, workspace());
  EXPECT_EQ(clear.kind, ImpactKind::no_impact);
  EXPECT_EQ(clear.time, settings.duration);
}

/// A torus turned anyhow or by right angles, there coaxial, its lowest corner above the level face
/// of a shape: many points of the face support one direction.
TEST(TimeOfImpact, OfCornersAboveLevelFaces) {
  RandomPairs random(12);
  const Shape shapes[] = {BoxShape{{1, 1, 1}}, BoxShape{{1, 1, 0.01}}, CylinderShape{2, 1},
                          CylinderShape{2, 0.01}};
  const std::vector<Vector3d> corners = torus_mesh(0.5, 0.15, 24, 12).vertices;
  ImpactSettings settings;
  settings.tolerance = 1e-3;
  for (int i = 0; i < 2000; ++i) {
    const Shape& shape = shapes[i % 4];
    const double top = i % 2 == 0 ? 1 : 0.01, gap = std::pow(10, random.uniform(-5, 0));
    Pose pose = random.pose(0.3);
    if (i % 8 >= 4) {
      pose = {{1, 0, 0, 0}, {0, 0, 0}};
      pose.q[1 + i / 8 % 3] = i / 24 % 3 - 1;
    }
    const Eigen::Matrix3d turn = unit_rotation(pose).toRotationMatrix();
    double low = 0;
    for (const Vector3d& corner : corners) low = std::min(low, (turn * corner).z());
    pose.t[2] = top + gap - low;
    const PlacedShape floor{shape, {}, 1};
    for (const double speed : {0.0, 5.0})
      EXPECT_EQ(time_of_impact(floor, {torus().view(), pose, 1}, {{}, straight({0, 0, speed})},
                               settings, workspace())
                    .kind,
                ImpactKind::no_impact)
          << i << ' ' << gap;
    pose.t[2] += 3;
    const TimeOfImpact found =
        time_of_impact(floor, {torus().view(), pose, 1}, {{}, straight({0, 0, -3 - 2 * gap})},
                       settings, workspace());
    EXPECT_EQ(found.kind, ImpactKind::impact) << i;
    const double left = gap + 3 - found.time * (3 + 2 * gap);
    EXPECT_GE(left, settings.tolerance / 2 * (1 - 1e-9)) << i;
    EXPECT_LE(found.distance_min, left * (1 + 1e-9)) << i;
    EXPECT_GE(found.distance_max, left * (1 - 1e-9)) << i;
  }
}

TEST(TimeOfImpact, OfPrimitives) {
  // A corner of the cube hits each of these at (h, 0, 0) when it has come so far.
  const Eigen::Quaterniond corner_first(
      Eigen::AngleAxisd(std::acos(std::sqrt(1.0 / 3)), Vector3d(0, 1, -1).normalized()));
  ImpactSettings settings;
  settings.tolerance = 1e-4;
  const Shape shapes[] = {BallShape{0.7}, CapsuleShape{0.7, 0.4}, CylinderShape{0.7, 0.4},
                          BoxShape{{0.7, 0.5, 0.4}}};
  for (const Shape& shape : shapes) {
    const Eigen::Quaterniond& q = corner_first;
    const Pose start{{q.w(), q.x(), q.y(), q.z()}, {-5, 0, 0}};
    const TimeOfImpact found = time_of_impact(PlacedShape{shape, {}, 1}, {cube().view(), start, 1},
                                              {{}, straight({8, 0, 0})}, settings, workspace());
    EXPECT_EQ(found.kind, ImpactKind::impact) << shape.index();
    const double want = 5 - 0.7 - std::sqrt(0.75);
    EXPECT_LE(8 * found.time, want - 0.5e-4 + 1e-7);
    EXPECT_GE(8 * found.time, want - 1e-4 - 1e-7);
    EXPECT_LE((found.normal + Vector3d::UnitX()).norm(), 1e-3);
    // Past it, a little further away than the two are wide.
    const TimeOfImpact past =
        time_of_impact(PlacedShape{shape, {}, 1}, {cube().view(), at({-5, 1.21, 0}), 1},
                       {{}, straight({10, 0, 0})}, settings, workspace());
    EXPECT_EQ(past.kind, ImpactKind::no_impact) << shape.index();
  }
}

TEST(TimeOfImpact, OfFieldsThatTellNoDirection) {
  ImpactSettings settings;
  settings.tolerance = 0.01;
  settings.duration = 10;
  const std::vector<float> flat(9, 0.25f);
  HeightFieldShape terrain;
  terrain.heights = flat.data();
  terrain.columns = terrain.rows = 3;
  const auto plane = [](const void*, const Vector3d& x) noexcept {
    return ShapeSample{x.z() - 0.25, Vector3d::UnitZ()};
  };
  for (const Shape& field : {Shape{terrain}, Shape{FunctionShape{plane, nullptr, 0}}}) {
    const TimeOfImpact found =
        time_of_impact(PlacedShape{field, {}, 1}, {ball().view(), at({1, 1, 3}), 1},
                       {{}, straight({0.3, 0, -1})}, settings, workspace());
    EXPECT_EQ(found.kind, ImpactKind::impact) << field.index();
    EXPECT_NEAR(found.time, 3 - 0.25 - 1, 0.02);
    EXPECT_LE(found.distance_max, settings.tolerance);
    const TimeOfImpact away =
        time_of_impact(PlacedShape{field, {}, 1}, {ball().view(), at({1, 1, 1.4}), 1},
                       {{}, {{0.3, 0, 0}, {0, 0, 3}, Vector3d::Zero()}}, settings, workspace());
    EXPECT_EQ(away.kind, ImpactKind::no_impact) << field.index();
    EXPECT_EQ(time_of_impact(PlacedShape{field, {}, 1}, {ball().view(), at({1, 1, 1}), 1}, {},
                             settings, workspace())
                  .kind,
              ImpactKind::overlapping);
  }
}

/// Solids at many times of their motions.
class Certified : public ::testing::Test {
 protected:
  void check(const PlacedAsset& a, const PlacedAsset& b, const Motions& motions,
             const ImpactSettings& settings) {
    const TimeOfImpact found = time_of_impact(a, b, motions, settings, workspace());
    ++count_[static_cast<int>(found.kind)];
    const auto at_time = [](const PlacedAsset& start, const Motion& motion, double time) {
      return PlacedAsset{start.asset, moved(start.pose, motion, time, start.scale), start.scale};
    };
    const auto apart = [&](double time) {
      return distance(corners(at_time(a, motions.a, time)), corners(at_time(b, motions.b, time)));
    };
    if (found.kind == ImpactKind::overlapping) {
      EXPECT_EQ(found.time, 0);
      EXPECT_GT(penetration(a, b, {.measure = Measure::exact}, workspace()).volume, 0);
      return;
    }
    for (int i = 0; i <= 12; ++i) {
      const double time = found.time * i / 12;
      EXPECT_GT(apart(time), 0) << time << " of " << found.time;
      const Separation gap =
          separation(at_time(a, motions.a, time), at_time(b, motions.b, time), {}, workspace());
      EXPECT_GT(gap.distance, 0);
    }
    const double gap = apart(found.time);
    EXPECT_GE(gap, found.distance_min * (1 - 1e-9));
    EXPECT_LE(gap, found.distance_max * (1 + 1e-9));
    if (found.kind == ImpactKind::impact) {
      EXPECT_LE(gap, settings.tolerance);
      // The distance of a pair that reaches the tolerance; another may be nearer by a part of it.
      const double between = (found.point_b - found.point_a).norm();
      EXPECT_GE(between, gap - 1e-9);
      EXPECT_LE(between, found.distance_max + 1e-9);
      EXPECT_NEAR((found.point_b - found.point_a).dot(found.normal), between, 1e-6);
      // A little later they are nearer.
      EXPECT_LT(apart(found.time + 1e-3 * settings.tolerance), gap);
    }
  }
  int count_[6] = {};
};

TEST_F(Certified, NothingTouchesBeforeTheTime) {
  std::mt19937_64 random(3);
  ImpactSettings settings;
  settings.tolerance = 1e-3;
  const Asset* const assets[] = {&cube(), &torus(), &ball(), &rod()};
  for (int i = 0; i < 120; ++i) {
    const PlacedAsset a{assets[i % 4]->view(), random_pose(random, 0.2), 1};
    const PlacedAsset b{assets[i / 4 % 4]->view(), random_pose(random, 1.9),
                        i % 3 == 0 ? 0.3 : 1.0};
    Motions motions{random_motion(random, i % 2 == 0 ? 0.3 : 0, i % 5 == 0 ? 0 : 3),
                    random_motion(random, 1, i % 3 == 0 ? 8 : 1)};
    motions.b.velocity -= Vector3d(b.pose.t[0], b.pose.t[1], b.pose.t[2]);
    SCOPED_TRACE(i);
    check(a, b, motions, settings);
  }
  EXPECT_GT(count_[static_cast<int>(ImpactKind::impact)], 25);
  EXPECT_GT(count_[static_cast<int>(ImpactKind::no_impact)], 25);
  EXPECT_GT(count_[static_cast<int>(ImpactKind::overlapping)], 3);
  EXPECT_EQ(count_[static_cast<int>(ImpactKind::unresolved)], 0);
}

TEST(TimeOfImpact, OfCoverBallsIsEarlierAndSaysSo) {
  std::mt19937_64 random(4);
  ImpactSettings settings;
  settings.tolerance = 1e-3;
  int unresolved = 0;
  for (int i = 0; i < 60; ++i) {
    const Pose pose = random_pose(random, 3);
    const Motions motions{random_motion(random, 0.1, 1), random_motion(random, 0.5, 2)};
    Motions towards = motions;
    towards.b.velocity -= 2 * Vector3d(pose.t[0], pose.t[1], pose.t[2]);
    const auto ask = [&](const Asset& a, const Asset& b) {
      return time_of_impact(PlacedAsset{a.view(), {}, 1}, {b.view(), pose, 1}, towards, settings,
                            workspace());
    };
    const TimeOfImpact exact = ask(torus(), ball());
    for (const TimeOfImpact& coarse :
         {ask(torus_of_spheres(), ball()), ask(torus(), ball_of_spheres()),
          ask(torus_of_spheres(), ball_of_spheres())}) {
      EXPECT_LE(coarse.time, exact.time);
      if (coarse.kind == ImpactKind::no_impact) continue;
      EXPECT_EQ(coarse.kind, ImpactKind::unresolved);
      EXPECT_GE(coarse.distance_max, settings.tolerance);
      EXPECT_LE(coarse.distance_max, 0.6);
      ++unresolved;
    }
  }
  EXPECT_GT(unresolved, 60);
}

/// A ball of a hundredth of the wall's thickness, shot through the wall.
TEST(TimeOfImpact, NoBulletPasses) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  for (double speed = 1e-3; speed < 2e9; speed *= 10) {
    for (int i = 0; i < 20; ++i) {
      // From one side to the other in one step, or as far as the step leads.
      Vector3d direction;
      do {
        direction = random_vector([&] { return normal(random); }).normalized();
      } while (std::abs(direction.z()) < 0.05);
      const Vector3d hit(20 * (uniform(random) - 0.5), 20 * (uniform(random) - 0.5),
                         direction.z() > 0 ? 0.0 : 1.0);
      const double share = 0.1 + 0.8 * uniform(random);
      const Pose spun = random_pose(random, 0);
      Pose start = spun;
      const Vector3d from = hit - (share * speed + 0.005 / std::abs(direction.z())) * direction;
      for (int k = 0; k < 3; ++k) start.t[k] = from[k];
      Motion motion = straight(speed * direction);
      motion.angular_velocity = random_vector([&] { return 3 * normal(random); });
      const TimeOfImpact found =
          time_of_impact(PlacedAsset{wall().view(), {}, 1}, {ball().view(), start, 0.005},
                         {{}, motion}, {}, workspace());
      EXPECT_EQ(found.kind, ImpactKind::impact) << speed << " " << i;
      const Vector3d centre = from + motion.velocity * found.time;
      const double height = direction.z() > 0 ? -centre.z() : centre.z() - 1;
      const double rounding = 1e-15 * speed;
      EXPECT_GE(height, 0.00499 * 0.95 - rounding) << speed;
      EXPECT_LE(height, 0.005 + 1e-5 + rounding) << speed;
    }
  }
}

/// Walls a hundredth as thick as the bullet, and the bullet's size far from the wall's.
TEST(TimeOfImpact, NoBulletPassesAThinWall) {
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal;
  const Asset sheet = baked(box_mesh({-1, -1, 0}, {1, 1, 1e-3}), "sheet", 400);
  for (const double scale : {1e-6, 1e-3, 0.1, 1.0}) {
    for (const double speed : {1.0, 1e3, 1e6}) {
      for (const double size : {1e-6, 1.0, 1e6}) {
        Vector3d direction = random_vector([&] { return normal(random); });
        direction.z() = 1 + std::abs(direction.z());
        direction.normalize();
        Pose start = random_pose(random, 0);
        const Vector3d from =
            size * (Vector3d(0.1, 0.2, 0) - (0.4 * speed + 3 * scale) * direction);
        for (int k = 0; k < 3; ++k) start.t[k] = from[k];
        Motion motion = straight(size * (speed + 6 * scale) * direction);
        motion.angular_velocity = random_vector([&] { return 10 * normal(random); });
        const TimeOfImpact found =
            time_of_impact(PlacedAsset{sheet.view(), {}, size},
                           {torus().view(), start, size * scale}, {{}, motion}, {}, workspace());
        // An impact hidden by the rounding of so long a path is reported, never skipped.
        const bool told = 1e-15 * speed < 1e-4 * scale;
        EXPECT_EQ(found.kind, told ? ImpactKind::impact : ImpactKind::unresolved)
            << scale << " " << speed << " " << size;
        EXPECT_GT(found.time, 0);
        EXPECT_LT(found.time, 0.45);
      }
    }
  }
}

}  // namespace
}  // namespace ist
