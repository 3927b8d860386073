#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/pose_eigen.h>
#include <ist/time_of_impact.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "query/impact/convex_pair.h"
#include "query/impact/moving_frame.h"
#include "support/float_traps.h"
#include "support/random_assets.h"
#include "support/test_meshes.h"

// Times of impact against closed forms, against all pairs of triangles at many times of the motion,
// and at speeds at which no step would find the wall.

namespace ist {
namespace {

using Eigen::Vector3d;
using testing::random_pose;
using testing::random_vector;

constexpr double kPi = std::numbers::pi;

Asset baked(TriangleMesh mesh, const char* name, std::size_t spheres, bool field = true) {
  PackingSettings settings;
  settings.max_spheres = spheres;
  settings.field.wanted = field;
  return bake(close_mesh(std::move(mesh), name), settings);
}

const Asset& cube() {
  static const Asset asset = baked(testing::cube_mesh(), "cube", 400);
  return asset;
}
const Asset& torus() {
  static const Asset asset = baked(testing::torus_mesh(0.5, 0.15, 24, 12), "torus", 400);
  return asset;
}
const Asset& ball() {
  static const Asset asset = baked(testing::icosphere_mesh(2), "ball", 300);
  return asset;
}
const Asset& ball_of_spheres() {
  static const Asset asset = baked(testing::icosphere_mesh(2), "ball", 300, false);
  return asset;
}
const Asset& torus_of_spheres() {
  static const Asset asset = baked(testing::torus_mesh(0.5, 0.15, 24, 12), "torus", 400, false);
  return asset;
}
/// 1 thick along z.
const Asset& wall() {
  static const Asset asset = baked(testing::box_mesh({-50, -50, 0}, {50, 50, 1}), "wall", 400);
  return asset;
}
const Asset& rod() {
  static const Asset asset =
      baked(testing::box_mesh({-1, -0.05, -0.05}, {1, 0.05, 0.05}), "rod", 100);
  return asset;
}

Workspace& workspace() {
  static Workspace one;
  return one;
}

Pose at(const Vector3d& t) { return {{1, 0, 0, 0}, {t.x(), t.y(), t.z()}}; }

Motion straight(const Vector3d& velocity) { return {velocity, Vector3d::Zero(), Vector3d::Zero()}; }

/// The corners of all triangles of an asset's surface at a pose, three in a row.
std::vector<Vector3d> corners(const PlacedTree& placed) {
  const ImpactSide side(placed.tree);
  const AssetHeader& header = placed.tree.header();
  const Eigen::Isometry3d to_world = to_isometry(placed.pose);
  std::vector<Vector3d> all;
  for (std::uint32_t block = 0; block < side.surface()->level[0].count; ++block) {
    for (std::uint32_t lane = 0; lane < side.surface()->blocks[block].triangles; ++lane) {
      const ConvexPiece piece = side.piece(kWidth * block + lane);
      for (const Vector3d& x : piece.corner)
        all.push_back(to_world * (placed.scale *
                                  (std::ldexp(1, header.exponent) * x + Vector3d(header.centre))));
    }
  }
  return all;
}

/// Distance of two surfaces, all pairs; 0 where they cross.
double distance(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
  double best = std::numeric_limits<double>::infinity();
  const auto triangle = [](const std::vector<Vector3d>& from, std::size_t i) {
    return ConvexPiece{{from[i], from[i + 1], from[i + 2]}, 3, 0, 0};
  };
  const auto middle_and_reach = [](const ConvexPiece& t) {
    const Vector3d m = (t.corner[0] + t.corner[1] + t.corner[2]) / 3;
    return std::pair(m, std::max({(t.corner[0] - m).norm(), (t.corner[1] - m).norm(),
                                  (t.corner[2] - m).norm()}));
  };
  for (std::size_t i = 0; i < a.size(); i += 3) {
    const ConvexPiece ta = triangle(a, i);
    const auto [ma, ra] = middle_and_reach(ta);
    for (std::size_t j = 0; j < b.size(); j += 3) {
      const ConvexPiece tb = triangle(b, j);
      const auto [mb, rb] = middle_and_reach(tb);
      if ((mb - ma).norm() - ra - rb > best) continue;
      if (triangles_cross(ta, tb)) return 0;
      best = std::min(best, nearest_points(ta, tb).distance);
    }
  }
  return best;
}

Motion random_motion(std::mt19937_64& random, double speed, double spin) {
  std::normal_distribution<double> normal;
  const auto draw = [&] { return normal(random); };
  return {speed * random_vector(draw), spin * random_vector(draw), 0.3 * random_vector(draw)};
}

TEST(Motions, LeadFromPoseToPose) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 200; ++i) {
    const Pose from = random_pose(random, 2), to = random_pose(random, 3);
    const Vector3d about(0.3, -0.2, 0.7);
    const Motion motion = motion_between(from, to, 0.25, about, 2);
    EXPECT_LE(motion.angular_velocity.norm() * 0.25, kPi + 1e-12);
    const PlacedTree start{cube().view(), from, 2};
    const Eigen::Isometry3d end = to_isometry(moved(start, motion, 0.25).pose);
    EXPECT_LE((end.matrix() - to_isometry(to).matrix()).norm(), 1e-13);
    // Half-way the point is half-way, and the rotation is the slerp.
    const Eigen::Isometry3d half = to_isometry(moved(start, motion, 0.125).pose);
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
  for (const double h : {-kPi / 2, -1.0, -1e-9, 0.0, 1e-5, 0.5, 1.2, kPi / 2}) {
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

TEST(TimeOfImpact, OfACubeThatFallsOnAPlane) {
  const PlacedField floor{HalfSpaceField{}, {}, 1};
  for (const double speed : {1e-3, 1.0, 1e3}) {
    ImpactSettings settings;
    settings.duration = 10 / speed;
    settings.tolerance = 1e-3;
    const TimeOfImpact found =
        time_of_impact(floor, {cube().view(), at({0.3, 0.2, 2.5}), 1},
                       {{}, straight({0, 0, -speed})}, settings, workspace());
    EXPECT_EQ(found.status, ImpactStatus::impact);
    EXPECT_GE(found.time * speed, 2 - 1e-3);
    EXPECT_LE(found.time * speed, 2 - 0.5e-3 + 1e-6);
    EXPECT_GE(found.distance_min, 0.49e-3);
    EXPECT_LE(found.distance_max, 1e-3);
    EXPECT_LE((found.normal - Vector3d::UnitZ()).norm(), 1e-12);
    EXPECT_NEAR(found.point_b.z(), 2 - found.time * speed, 1e-6);
    EXPECT_NEAR(found.point_a.z(), 0, 1e-6);
  }
}

TEST(TimeOfImpact, OfASpinningRodAndAWall) {
  // The rod turns about its middle, d before the wall: cos θ + 0.05 sin θ = d, with x and z
  // swapped.
  for (const double d : {0.3, 0.7, 0.95}) {
    double low = 0, high = kPi / 2;
    for (int i = 0; i < 100; ++i) {
      const double middle = (low + high) / 2;
      (std::sin(middle) + 0.05 * std::cos(middle) < d ? low : high) = middle;
    }
    ImpactSettings settings;
    settings.duration = 100;
    settings.tolerance = 1e-4;
    const Motion spin{Vector3d::Zero(), {0, -0.5, 0}, Vector3d::Zero()};
    const TimeOfImpact field =
        time_of_impact(PlacedField{HalfSpaceField{}, {}, 1}, {rod().view(), at({0, 0, d}), 1},
                       {{}, spin}, settings, workspace());
    const TimeOfImpact tree =
        time_of_impact(PlacedTree{wall().view(), at({0, 0, -1}), 1},
                       {rod().view(), at({0, 0, d}), 1}, {{}, spin}, settings, workspace());
    const TimeOfImpact box =
        time_of_impact(PlacedField{BoxField{{9, 9, 1}}, at({0, 0, -1}), 1},
                       {rod().view(), at({0, 0, d}), 1}, {{}, spin}, settings, workspace());
    // Seen from the rod the wall goes round it.
    const TimeOfImpact around = time_of_impact(
        PlacedTree{wall().view(), at({0, 0, -1}), 1}, {rod().view(), at({0, 0, d}), 1},
        {{Vector3d::Zero(), {0, 0.5, 0}, {0, 0, 1 + d}}, {}}, settings, workspace());
    const TimeOfImpact field_around =
        time_of_impact(PlacedField{HalfSpaceField{}, {}, 1}, {rod().view(), at({0, 0, d}), 1},
                       {{Vector3d::Zero(), {0, 0.5, 0}, {0, 0, d}}, {}}, settings, workspace());
    for (const TimeOfImpact& found : {field, tree, box, around, field_around}) {
      EXPECT_EQ(found.status, ImpactStatus::impact);
      EXPECT_LE(found.time, 2 * low);
      EXPECT_GE(found.time, 2 * low - 2 * 1.1e-4 / std::cos(low));
    }
  }
  // Just out of reach, for a hundred thousand turns.
  ImpactSettings settings;
  settings.duration = 1e5 * 2 * kPi;
  settings.tolerance = 1e-4;
  const TimeOfImpact clear =
      time_of_impact(PlacedField{HalfSpaceField{}, {}, 1}, {rod().view(), at({0, 0, 1.01}), 1},
                     {{}, {Vector3d::Zero(), {0, 0, 1}, Vector3d::Zero()}}, settings, workspace());
  EXPECT_EQ(clear.status, ImpactStatus::no_impact);
  EXPECT_EQ(clear.time, settings.duration);
}

TEST(TimeOfImpact, OfPrimitives) {
  // A corner of the cube hits each of these at (h, 0, 0) when it has come so far.
  const Eigen::Quaterniond corner_first =
      Eigen::Quaterniond::FromTwoVectors(Vector3d::Ones().normalized().eval(), Vector3d::UnitX());
  ImpactSettings settings;
  settings.tolerance = 1e-4;
  const Field shapes[] = {BallField{0.7}, CapsuleField{0.7, 0.4}, CylinderField{0.7, 0.4},
                          BoxField{{0.7, 0.5, 0.4}}};
  for (const Field& shape : shapes) {
    const Eigen::Quaterniond& q = corner_first;
    const Pose start{{q.w(), q.x(), q.y(), q.z()}, {-5, 0, 0}};
    const TimeOfImpact found = time_of_impact(PlacedField{shape, {}, 1}, {cube().view(), start, 1},
                                              {{}, straight({8, 0, 0})}, settings, workspace());
    EXPECT_EQ(found.status, ImpactStatus::impact) << shape.index();
    const double want = 5 - 0.7 - std::sqrt(0.75);
    EXPECT_LE(8 * found.time, want - 0.5e-4 + 1e-7);
    EXPECT_GE(8 * found.time, want - 1e-4 - 1e-7);
    EXPECT_LE((found.normal + Vector3d::UnitX()).norm(), 1e-3);
    // Past it, a little further away than the two are wide.
    const TimeOfImpact past =
        time_of_impact(PlacedField{shape, {}, 1}, {cube().view(), at({-5, 1.21, 0}), 1},
                       {{}, straight({10, 0, 0})}, settings, workspace());
    EXPECT_EQ(past.status, ImpactStatus::no_impact) << shape.index();
  }
}

TEST(TimeOfImpact, OfFieldsThatTellNoDirection) {
  ImpactSettings settings;
  settings.tolerance = 0.01;
  settings.duration = 10;
  const std::vector<float> flat(9, 0.25f);
  HeightField terrain;
  terrain.heights = flat.data();
  terrain.columns = terrain.rows = 3;
  const auto plane = [](const void*, const Vector3d& x) noexcept {
    return FieldSample{0.25 - x.z(), -Vector3d::UnitZ()};
  };
  for (const Field& field : {Field{terrain}, Field{FunctionField{plane, nullptr, 0}}}) {
    const TimeOfImpact found =
        time_of_impact(PlacedField{field, {}, 1}, {ball().view(), at({1, 1, 3}), 1},
                       {{}, straight({0.3, 0, -1})}, settings, workspace());
    EXPECT_EQ(found.status, ImpactStatus::impact) << field.index();
    EXPECT_NEAR(found.time, 3 - 0.25 - 1, 0.02);
    EXPECT_LE(found.distance_max, settings.tolerance);
    const TimeOfImpact away =
        time_of_impact(PlacedField{field, {}, 1}, {ball().view(), at({1, 1, 1.4}), 1},
                       {{}, {{0.3, 0, 0}, {0, 0, 3}, Vector3d::Zero()}}, settings, workspace());
    EXPECT_EQ(away.status, ImpactStatus::no_impact) << field.index();
    EXPECT_EQ(time_of_impact(PlacedField{field, {}, 1}, {ball().view(), at({1, 1, 1}), 1}, {},
                             settings, workspace())
                  .status,
              ImpactStatus::overlapping);
  }
}

/// Solids at many times of their motions.
class Certified : public ::testing::Test {
 protected:
  void check(const PlacedTree& a, const PlacedTree& b, const Motions& motions,
             const ImpactSettings& settings) {
    const TimeOfImpact found = time_of_impact(a, b, motions, settings, workspace());
    ++count_[static_cast<int>(found.status)];
    const auto apart = [&](double time) {
      return distance(corners(moved(a, motions.a, time)), corners(moved(b, motions.b, time)));
    };
    if (found.status == ImpactStatus::overlapping) {
      EXPECT_EQ(found.time, 0);
      PenetrationSettings exact;
      exact.field = FieldUse::always;
      EXPECT_GT(penetration(a, b, exact, workspace()).volume, 0);
      return;
    }
    for (int i = 0; i <= 12; ++i) {
      const double time = found.time * i / 12;
      EXPECT_GT(apart(time), 0) << time << " of " << found.time;
      EXPECT_GT(separation(moved(a, motions.a, time), moved(b, motions.b, time), {}, workspace())
                    .distance,
                0);
    }
    const double gap = apart(found.time);
    EXPECT_GE(gap, found.distance_min * (1 - 1e-9));
    EXPECT_LE(gap, found.distance_max * (1 + 1e-9));
    if (found.status == ImpactStatus::impact) {
      EXPECT_LE(gap, settings.tolerance);
      EXPECT_NEAR((found.point_b - found.point_a).norm(), gap, 1e-6);
      EXPECT_NEAR((found.point_b - found.point_a).dot(found.normal), gap, 1e-6);
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
    const PlacedTree a{assets[i % 4]->view(), random_pose(random, 0.2), 1};
    const PlacedTree b{assets[i / 4 % 4]->view(), random_pose(random, 1.9), i % 3 == 0 ? 0.3 : 1.0};
    Motions motions{random_motion(random, i % 2 == 0 ? 0.3 : 0, i % 5 == 0 ? 0 : 3),
                    random_motion(random, 1, i % 3 == 0 ? 8 : 1)};
    motions.b.velocity -= Vector3d(b.pose.t[0], b.pose.t[1], b.pose.t[2]);
    SCOPED_TRACE(i);
    check(a, b, motions, settings);
  }
  EXPECT_GT(count_[static_cast<int>(ImpactStatus::impact)], 25);
  EXPECT_GT(count_[static_cast<int>(ImpactStatus::no_impact)], 25);
  EXPECT_GT(count_[static_cast<int>(ImpactStatus::overlapping)], 3);
  EXPECT_EQ(count_[static_cast<int>(ImpactStatus::unresolved)], 0);
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
      return time_of_impact(PlacedTree{a.view(), {}, 1}, {b.view(), pose, 1}, towards, settings,
                            workspace());
    };
    const TimeOfImpact exact = ask(torus(), ball());
    for (const TimeOfImpact& coarse :
         {ask(torus_of_spheres(), ball()), ask(torus(), ball_of_spheres()),
          ask(torus_of_spheres(), ball_of_spheres())}) {
      EXPECT_LE(coarse.time, exact.time);
      if (coarse.status == ImpactStatus::no_impact) continue;
      EXPECT_EQ(coarse.status, ImpactStatus::unresolved);
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
      Vector3d way;
      do {
        way = random_vector([&] { return normal(random); }).normalized();
      } while (std::abs(way.z()) < 0.05);
      const Vector3d hit(20 * (uniform(random) - 0.5), 20 * (uniform(random) - 0.5),
                         way.z() > 0 ? 0.0 : 1.0);
      const double share = 0.1 + 0.8 * uniform(random);
      const Pose spun = random_pose(random, 0);
      Pose start = spun;
      const Vector3d from = hit - (share * speed + 0.005 / std::abs(way.z())) * way;
      for (int k = 0; k < 3; ++k) start.t[k] = from[k];
      Motion motion = straight(speed * way);
      motion.angular_velocity = random_vector([&] { return 3 * normal(random); });
      const TimeOfImpact found =
          time_of_impact(PlacedTree{wall().view(), {}, 1}, {ball().view(), start, 0.005},
                         {{}, motion}, {}, workspace());
      EXPECT_EQ(found.status, ImpactStatus::impact) << speed << " " << i;
      const Vector3d centre = from + motion.velocity * found.time;
      const double height = way.z() > 0 ? -centre.z() : centre.z() - 1;
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
  const Asset sheet = baked(testing::box_mesh({-1, -1, 0}, {1, 1, 1e-3}), "sheet", 400);
  for (const double scale : {1e-6, 1e-3, 0.1, 1.0}) {
    for (const double speed : {1.0, 1e3, 1e6}) {
      for (const double size : {1e-6, 1.0, 1e6}) {
        Vector3d way = random_vector([&] { return normal(random); });
        way.z() = 1 + std::abs(way.z());
        way.normalize();
        Pose start = random_pose(random, 0);
        const Vector3d from = size * (Vector3d(0.1, 0.2, 0) - (0.4 * speed + 3 * scale) * way);
        for (int k = 0; k < 3; ++k) start.t[k] = from[k];
        Motion motion = straight(size * (speed + 6 * scale) * way);
        motion.angular_velocity = random_vector([&] { return 10 * normal(random); });
        const TimeOfImpact found =
            time_of_impact(PlacedTree{sheet.view(), {}, size},
                           {torus().view(), start, size * scale}, {{}, motion}, {}, workspace());
        // What the rounding of so long a way hides is said, never passed over.
        const bool told = 1e-15 * speed < 1e-4 * scale;
        EXPECT_EQ(found.status, told ? ImpactStatus::impact : ImpactStatus::unresolved)
            << scale << " " << speed << " " << size;
        EXPECT_GT(found.time, 0);
        EXPECT_LT(found.time, 0.45);
      }
    }
  }
}

TEST(TimeOfImpact, OneHoldsTheOther) {
  for (const bool first : {false, true}) {
    const PlacedTree small{torus().view(), {}, 0.1}, large{cube().view(), {}, 1};
    const TimeOfImpact found =
        first ? time_of_impact(small, large, {}, {}, workspace())
              : time_of_impact(large, small, {{}, straight({1, 0, 0})}, {}, workspace());
    EXPECT_EQ(found.status, ImpactStatus::overlapping);
    EXPECT_EQ(found.time, 0);
  }
  const PlacedTree large{cube().view(), {}, 1};
  for (const Field& inside : {Field{BallField{0.1}}, Field{BoxField{{0.1, 0.1, 0.1}}},
                              Field{BallField{2}}, Field{HalfSpaceField{{0, 0, 1}, 1}}})
    EXPECT_EQ(time_of_impact(PlacedField{inside, {}, 1}, large, {}, {}, workspace()).status,
              ImpactStatus::overlapping);
  // In the hole of a ring it is free.
  const TimeOfImpact free =
      time_of_impact(PlacedTree{torus().view(), {}, 1}, {cube().view(), {}, 0.2},
                     {{}, straight({0, 0, 3})}, {}, workspace());
  EXPECT_EQ(free.status, ImpactStatus::no_impact);
}

TEST(TimeOfImpact, WhatSlidesOrPartsIsNoImpact) {
  ImpactSettings settings;
  settings.tolerance = 1e-2;
  const double gap = 1e-3;  // nearer than the tolerance
  const PlacedTree floor{wall().view(), {}, 1}, box{cube().view(), at({0, 0, 1.5 + gap}), 1};
  const Motion slide = straight({30, 7, 0}), part = straight({1, 0, 1}),
               sink = straight({0, 0, -1});
  const Motion spin{{1, 2, 0}, {0, 0, 5}, Vector3d::Zero()};
  for (const Motion& motion : {slide, part, spin, Motion{}}) {
    EXPECT_EQ(time_of_impact(floor, box, {{}, motion}, settings, workspace()).status,
              ImpactStatus::no_impact);
    EXPECT_EQ(time_of_impact(PlacedField{HalfSpaceField{}, at({0, 0, 1}), 1}, box, {{}, motion},
                             settings, workspace())
                  .status,
              ImpactStatus::no_impact);
  }
  const TimeOfImpact found = time_of_impact(floor, box, {{}, sink}, settings, workspace());
  EXPECT_EQ(found.status, ImpactStatus::impact);
  EXPECT_EQ(found.time, 0);
  // Both move alike, however fast.
  EXPECT_EQ(time_of_impact(floor, box, {straight({1e6, 1e6, 1e6}), straight({1e6, 1e6, 1e6})},
                           settings, workspace())
                .status,
            ImpactStatus::no_impact);
}

TEST(TimeOfImpact, LimitsKeepWhatIsCertain) {
  std::mt19937_64 random(7);
  ImpactSettings settings;
  settings.tolerance = 1e-4;
  for (int i = 0; i < 20; ++i) {
    const PlacedTree a{torus().view(), random_pose(random, 0), 1};
    const PlacedTree b{ball().view(), random_pose(random, 2), 0.3};
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
        EXPECT_EQ(found.status, ImpactStatus::budget_exhausted);
      }
    }
    Workspace little(1);
    const TimeOfImpact small = time_of_impact(a, b, motions, settings, little);
    EXPECT_LE(small.time, whole.time);
    ImpactSettings soon = settings;
    soon.deadline_us = 1e-3;
    const TimeOfImpact late = time_of_impact(a, b, motions, soon, workspace());
    EXPECT_EQ(late.status, ImpactStatus::budget_exhausted);
    EXPECT_LE(late.time, whole.time);
    // Nothing of a query stays in the workspace.
    const TimeOfImpact again = time_of_impact(a, b, motions, settings, workspace());
    EXPECT_EQ(again.time, whole.time);
    EXPECT_EQ(again.node_visits, whole.node_visits);
  }
}

TEST(TimeOfImpact, RefusesWhatIsNoInput) {
  const testing::NoFloatTraps untrapped;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const PlacedTree a{cube().view(), {}, 1}, b{ball().view(), at({3, 0, 0}), 1};
  const auto status = [&](const PlacedTree& x, const PlacedTree& y, const Motions& motions,
                          double duration) {
    ImpactSettings settings;
    settings.duration = duration;
    const TimeOfImpact found = time_of_impact(x, y, motions, settings, workspace());
    EXPECT_EQ(found.time, found.status == ImpactStatus::invalid_input ? 0 : found.time);
    return found.status;
  };
  constexpr ImpactStatus kInvalid = ImpactStatus::invalid_input;
  EXPECT_EQ(status(a, b, {}, 1), ImpactStatus::no_impact);
  EXPECT_EQ(status(a, b, {}, 0), ImpactStatus::no_impact);
  for (const double bad : {nan, inf, -inf, -1.0}) EXPECT_EQ(status(a, b, {}, bad), kInvalid);
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
  EXPECT_EQ(status(a, {ball().view(), {{1, 1, 0, 0}, {3, 0, 0}}, 1}, {}, 1), kInvalid);
  EXPECT_EQ(status(a, {ball().view(), at({3, 0, 0}), -1}, {}, 1), kInvalid);
  EXPECT_EQ(status(a, b, {{}, motion_between({}, {}, 0)}, 1), kInvalid);
  EXPECT_EQ(status(a, b, {{}, motion_between({}, {{0, 0, 0, 0}, {}}, 1)}, 1), kInvalid);
  const auto of_field = [&](const Field& field) {
    return time_of_impact(PlacedField{field, {}, 1}, b, {}, {}, workspace()).status;
  };
  EXPECT_EQ(of_field(BallField{-1}), kInvalid);
  EXPECT_EQ(of_field(HalfSpaceField{{0, 0, 2}, 0}), kInvalid);
  EXPECT_EQ(of_field(MeshField{ball_of_spheres().view()}), kInvalid);
  EXPECT_EQ(of_field(MeshField{cube().view()}), ImpactStatus::no_impact);
  EXPECT_EQ(of_field(FunctionField{
                [](const void*, const Vector3d&) noexcept {
                  return FieldSample{std::numeric_limits<double>::quiet_NaN(), Vector3d::Zero()};
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
    const TimeOfImpact want = time_of_impact(
        PlacedTree{torus().view(), {}, 1}, {cube().view(), pose, 1}, {{}, motion}, {}, workspace());
    ASSERT_EQ(want.status, ImpactStatus::impact);
    for (const double size : {1e-6, 1e6}) {
      for (const double far : {0.0, 1e6}) {
        Pose pose_a, pose_b = pose;
        for (int k = 0; k < 3; ++k) {
          pose_a.t[k] = far * size;
          pose_b.t[k] = size * pose.t[k] + far * size;
        }
        Motion scaled = motion;
        scaled.velocity *= size;
        const TimeOfImpact found =
            time_of_impact(PlacedTree{torus().view(), pose_a, size}, {cube().view(), pose_b, size},
                           {{}, scaled}, {}, workspace());
        EXPECT_EQ(found.status, want.status);
        EXPECT_NEAR(found.time, want.time, far == 0 ? 1e-9 : 1e-4);
      }
    }
    // As fast again in half the time.
    Motion fast = motion;
    fast.velocity *= 1e6;
    fast.angular_velocity *= 1e6;
    ImpactSettings settings;
    settings.duration = 1e-6;
    const TimeOfImpact found =
        time_of_impact(PlacedTree{torus().view(), {}, 1}, {cube().view(), pose, 1}, {{}, fast},
                       settings, workspace());
    EXPECT_NEAR(1e6 * found.time, want.time, 1e-9);
  }
}

}  // namespace
}  // namespace ist
