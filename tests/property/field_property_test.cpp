#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/field.h>
#include <ist/query.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "query/probe/cap.h"
#include "support/box_overlap.h"
#include "support/float_traps.h"
#include "support/random_assets.h"
#include "support/reference_sum.h"
#include "support/test_meshes.h"

// Queries that meet a surface: of fields and trees, and of two trees by the surface of the coarser.

namespace ist {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using testing::random_pose;

Asset baked(TriangleMesh mesh, const char* name, std::size_t spheres) {
  PackingSettings settings;
  settings.max_spheres = spheres;
  return bake(close_mesh(std::move(mesh), name), settings);
}

const Asset& cube() {
  static const Asset asset = baked(testing::cube_mesh(), "cube", 1000);
  return asset;
}
const Asset& torus() {
  static const Asset asset = baked(testing::torus_mesh(0.35, 0.14, 40, 20), "torus", 800);
  return asset;
}
const Asset& coarse_torus() {
  static const Asset asset = baked(testing::torus_mesh(0.35, 0.14, 40, 20), "torus", 60);
  return asset;
}
const Asset& plate() {
  static const Asset asset = baked(testing::box_mesh({-1, -1, -0.01}, {1, 1, 0.01}), "plate", 1000);
  return asset;
}
const Asset& slab() {
  static const Asset asset = baked(testing::box_mesh({-1, -1, -0.2}, {1, 1, 0.2}), "slab", 1000);
  return asset;
}

Vector3d position(const Pose& pose) { return {pose.t[0], pose.t[1], pose.t[2]}; }
Quaterniond rotation(const Pose& pose) { return {pose.q[0], pose.q[1], pose.q[2], pose.q[3]}; }
Pose pose_of(const Quaterniond& q, const Vector3d& t) {
  return {{q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}};
}

/// A motion of a body from a pose on: along `v` and about `w`, by s.
struct Motion {
  Pose start;
  Vector3d v = Vector3d::Zero(), w = Vector3d::Zero();
  Pose at(double s) const {
    const double angle = w.norm();
    const Quaterniond turn =
        angle > 0 ? Quaterniond(Eigen::AngleAxisd(angle * s, w / angle)) : Quaterniond::Identity();
    return pose_of(turn * rotation(start), position(start) + s * v);
  }
};

using Ask = std::function<Penetration(const Pose&)>;

struct Work {
  double done = 0;    ///< ∫ of the forces and torques
  double moved = 0;   ///< ∫ of their magnitudes, whatever the direction
  double change = 0;  ///< of the volume
  double most = 0;    ///< largest volume on the way
};

/// By Simpson's rule from s = 0 to 1.
Work work_of(const Ask& ask, const Motion& motion, int steps) {
  Work work;
  for (int i = 0; i <= 2 * steps; ++i) {
    const double weight = (i == 0 || i == 2 * steps ? 1.0 : i % 2 == 1 ? 4.0 : 2.0) / (6.0 * steps);
    const Penetration p = ask(motion.at(0.5 * i / steps));
    work.most = std::max(work.most, p.volume);
    work.done +=
        weight * (p.translation_gradient.dot(motion.v) + p.rotation_gradient.dot(motion.w));
    work.moved += weight * (p.translation_gradient.norm() * motion.v.norm() +
                            p.rotation_gradient.norm() * motion.w.norm());
  }
  work.change = ask(motion.at(1)).volume - ask(motion.at(0)).volume;
  return work;
}

Vector3d random_direction(std::mt19937_64& random) {
  const Pose pose = random_pose(random, 1);
  return position(pose);
}

/// The volume changes by what its gradients say, along short ways in all directions. `rounding`:
/// relative, of a volume.
void expect_gradients(const char* name, const Ask& ask, const Pose& pose, double way,
                      double rounding, std::mt19937_64& random) {
  for (int kind = 0; kind < 3; ++kind) {
    Motion motion{pose};
    if (kind != 1) motion.v = way * random_direction(random);
    if (kind != 0) motion.w = 2 * way * random_direction(random);
    const Work work = work_of(ask, motion, 40);
    // Simpson's rule meets kinks of the force wherever a ball begins to touch; torques may cancel.
    const double slack = 1e-3 * work.moved + 1e-6 * way * std::pow(work.most, 2.0 / 3);
    EXPECT_NEAR(work.done, work.change, slack + rounding * work.most) << name
                                                                      << (kind == 0   ? " along"
                                                                          : kind == 1 ? " about"
                                                                                      : " both")
                                                                      << ", volume " << work.most;
  }
}

std::vector<std::pair<const char*, Field>> fields() {
  static const std::vector<float> heights = [] {
    std::vector<float> h;
    for (int j = 0; j < 9; ++j)
      for (int i = 0; i < 9; ++i)
        h.push_back(static_cast<float>(0.1 * std::sin(1.3 * i) * std::cos(0.9 * j)));
    return h;
  }();
  static const std::vector<float> distances = [] {
    std::vector<float> d;
    for (int k = 0; k < 21; ++k)
      for (int j = 0; j < 21; ++j)
        for (int i = 0; i < 21; ++i)
          d.push_back(
              static_cast<float>(0.5 - 0.1 * Vector3d(i - 10.0, j - 10.0, k - 10.0).norm()));
    return d;
  }();
  HeightField terrain;
  terrain.heights = heights.data();
  terrain.columns = terrain.rows = 9;
  terrain.spacing[0] = terrain.spacing[1] = 0.25;
  terrain.lowest = -0.11, terrain.highest = 0.11;
  DistanceGridField grid;
  grid.distances = distances.data();
  for (std::uint32_t& n : grid.size) n = 21;
  grid.origin = Vector3d::Constant(-1);
  grid.spacing = 0.1;
  FunctionField function;
  function.look = [](const void*, const Vector3d& x) noexcept {
    const double d = x.norm();
    return FieldSample{0.5 - d, d > 0 ? Vector3d(-x / d) : Vector3d::Zero().eval()};
  };
  return {{"half-space", HalfSpaceField{Vector3d(0.6, 0, 0.8), 0.1}},
          {"box", BoxField{Vector3d(0.5, 0.4, 0.3)}},
          {"thin box", BoxField{Vector3d(0.5, 0.4, 0.01)}},
          {"ball", BallField{0.5}},
          {"capsule", CapsuleField{0.3, 0.4}},
          {"cylinder", CylinderField{0.4, 0.3}},
          {"terrain", terrain},
          {"grid", grid},
          {"function", function},
          {"mesh", MeshField{torus().view()}}};
}

TEST(FieldQuery, GradientsAreThoseOfTheVolume) {
  Workspace workspace;
  std::mt19937_64 random(21);
  for (const auto& [name, field] : fields()) {
    const PlacedField a{field, random_pose(random, 0.3), 1.3};
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

TEST(FieldQuery, CylindersRimIsMetByEveryBall) {
  // Past the rim a ball is beside the mantle and above the end, and has a part of either: nodes may
  // not be left out by their way to the rim.
  Workspace workspace;
  const Asset one = testing::make_random_asset({300, 0.3, {}, 0}, 5);
  const PlacedField a{CylinderField{0.4, 0.3}, {}, 1};
  std::mt19937_64 random(31);
  std::uniform_real_distribution<double> uniform(0, 0.5);
  for (int i = 0; i < 400; ++i) {
    Pose pose = random_pose(random, 0);
    pose.t[0] = 0.4 + uniform(random), pose.t[2] = 0.3 + uniform(random);
    const PlacedTree b{one.view(), pose, 0.5};
    double want = 0;
    for (const testing::WorldSphere& s : testing::world_spheres(b, Measure::matched)) {
      const double whole = 4 * std::numbers::pi / 3 * s.r * s.r * s.r;
      const double slab =
          cap(s.r, 0.3 - s.centre.z()).volume + cap(s.r, 0.3 + s.centre.z()).volume - whole;
      want += cap(s.r, 0.4 - s.centre.head<2>().norm()).volume * std::max(0.0, slab) / whole;
    }
    EXPECT_NEAR(penetration(a, b, {}, workspace).volume, want, 1e-9 * want + 1e-15);
  }
}

struct Pair {
  const char* name;
  const Asset &a, &b;
  double scale_b;
  double distance;
};

std::vector<Pair> pairs() {
  return {{"fine on coarse", cube(), torus(), 0.2, 0.5},
          {"coarse on fine", coarse_torus(), cube(), 1.0, 0.5},
          {"like sizes", cube(), torus(), 1.0, 0.7},
          {"like sizes turned", torus(), cube(), 1.0, 0.7},
          {"large on small", torus(), cube(), 6.0, 2.9},
          {"thin", plate(), torus(), 0.5, 0.1}};
}

TEST(FieldPairs, GradientsAreThoseOfTheVolume) {
  Workspace workspace;
  std::mt19937_64 random(22);
  for (const Pair& pair : pairs()) {
    for (const FieldUse use : {FieldUse::automatic, FieldUse::always}) {
      int met = 0;
      for (int i = 0; i < 8; ++i) {
        const PlacedTree a{pair.a.view(), random_pose(random, 0.3), 1.2};
        Pose pose = random_pose(random, 1.2 * pair.distance);
        for (int k = 0; k < 3; ++k) pose.t[k] += a.pose.t[k];
        const Ask ask = [&](const Pose& p) {
          PenetrationSettings settings;
          settings.field = use;
          return penetration(a, {pair.b.view(), p, 1.2 * pair.scale_b}, settings, workspace);
        };
        met += ask(pose).volume > 0 ? 1 : 0;
        // Lenses are summed in float, to 1e-6.
        expect_gradients(pair.name, ask, pose, 0.02 * std::min(1.0, pair.scale_b),
                         use == FieldUse::always ? 1e-12 : 2e-6, random);
      }
      EXPECT_GT(met, 1) << pair.name;
    }
  }
}

TEST(FieldPairs, AnswersAreSound) {
  Workspace workspace;
  std::mt19937_64 random(23);
  for (const Pair& pair : pairs()) {
    for (const FieldUse use : {FieldUse::automatic, FieldUse::always, FieldUse::never}) {
      for (int i = 0; i < 20; ++i) {
        PenetrationSettings settings;
        settings.field = use;
        const PlacedTree a{pair.a.view(), random_pose(random, 0.3), 1.2};
        const PlacedTree b{pair.b.view(), random_pose(random, 1.2 * pair.distance),
                           1.2 * pair.scale_b};
        const Penetration ab = penetration(a, b, settings, workspace);
        const Penetration ba = penetration(b, a, settings, workspace);
        EXPECT_EQ(ab.status, QueryStatus::ok);
        EXPECT_LE(ab.volume_min, ab.volume);
        EXPECT_GE(ab.volume_max, ab.volume);
        EXPECT_LE(ab.volume_min, ba.volume * (1 + 1e-5));
        EXPECT_NEAR(ab.volume, ba.volume, 1e-5 * ab.volume) << pair.name;
        const double force = ab.translation_gradient.norm() + std::pow(ab.volume, 2.0 / 3);
        EXPECT_LE((ab.translation_gradient + ba.translation_gradient).norm(), 1e-4 * force)
            << pair.name;
        const Vector3d torque_a =
            ba.rotation_gradient + position(a.pose).cross(ba.translation_gradient);
        const Vector3d torque_b =
            ab.rotation_gradient + position(b.pose).cross(ab.translation_gradient);
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
TEST(FieldPairs, EnergyIsConservedOverClosedLoops) {
  Workspace workspace;
  for (const FieldUse use : {FieldUse::automatic, FieldUse::always}) {
    for (const bool swapped : {false, true}) {
      const PlacedTree fixed{cube().view(), {}, 1};
      const Vector3d axis = Vector3d(0.3, -0.5, 0.8).normalized();
      const auto pose = [&](double phase) {
        const double turn = 2 * std::numbers::pi * phase;
        return pose_of(Quaterniond(Eigen::AngleAxisd(turn, axis)),
                       {0.75 + 0.25 * std::cos(turn), 0.2 * std::sin(turn), 0.1});
      };
      const auto ask = [&](double phase) {
        PenetrationSettings settings;
        settings.field = use;
        const PlacedTree moving{torus().view(), pose(phase), 0.9};
        if (!swapped) return penetration(fixed, moving, settings, workspace);
        Penetration p = penetration(moving, fixed, settings, workspace);
        p.rotation_gradient =
            -(p.rotation_gradient - position(moving.pose).cross(p.translation_gradient));
        p.translation_gradient = -p.translation_gradient;
        return p;
      };
      const auto power = [&](double phase) {
        const double turn = 2 * std::numbers::pi * phase;
        const Penetration p = ask(phase);
        const Vector3d v(-0.25 * std::sin(turn), 0.2 * std::cos(turn), 0);
        return 2 * std::numbers::pi *
               (p.translation_gradient.dot(v) + p.rotation_gradient.dot(axis));
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
}

// A cube carried through a wall, turned or not: its overlap is known exactly.
TEST(FieldPairs, CarriedThroughAWall) {
  Workspace workspace;
  // Slab and cube are alike, so that lenses would answer where they are deep in each other.
  const PenetrationSettings exact = {.field = FieldUse::always};
  const Quaterniond turns[] = {Quaterniond::Identity(),
                               Quaterniond(0.9, 0.2, -0.3, 0.1).normalized()};
  for (const bool thin : {true, false}) {
    const double half = thin ? 0.01 : 0.2;
    for (const Quaterniond& q : turns) {
      for (const int way : {0, 1, 2}) {  // the wall as a field, as A, as B
        double last = 0, worst_jump = 0, error = 0, most = 0;
        constexpr int kSteps = 400;
        for (int i = 0; i <= kSteps; ++i) {
          const double z = -0.7 + 1.4 * i / kSteps;
          const PlacedTree body{cube().view(), pose_of(q, {0.05, -0.1, z}), 0.5};
          const PlacedTree wall{(thin ? plate() : slab()).view(), {}, 1};
          const Penetration got = way == 0 ? penetration(PlacedField{BoxField{{1, 1, half}}, {}, 1},
                                                         body, {}, workspace)
                                  : way == 1 ? penetration(wall, body, exact, workspace)
                                             : penetration(body, wall, exact, workspace);
          const double want = testing::overlap_volume(
              {Vector3d::Zero(), {1, 1, half}, Eigen::Matrix3d::Identity()},
              {{0.05, -0.1, z}, Vector3d::Constant(0.25), q.toRotationMatrix()});
          most = std::max(most, want);
          error = std::max(error, std::abs(got.volume - want));
          if (i > 0) worst_jump = std::max(worst_jump, std::abs(got.volume - last));
          last = got.volume;
        }
        std::printf("%s wall, way %d: worst error %.3f of the most\n", thin ? "thin" : "thick", way,
                    error / most);
        // A section of the cube is no larger than √3 · side² (turned); the balls that stand for it
        // have sections some tenths larger where their layers are.
        EXPECT_LE(worst_jump, 1.5 * std::sqrt(3.0) * 0.25 * 1.4 / kSteps) << thin << ' ' << way;
        // Balls of a layer cross a thin wall together: the cube's own faces are what is off.
        EXPECT_LE(error, (thin ? 0.08 : 0.01) * most) << thin << ' ' << way;
      }
    }
  }
}

// B ever smaller at the same place: its overlap in its own measure changes by little from size to
// size, whichever method answers.
TEST(FieldPairs, NoJumpWhereMethodsChangeHands) {
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
        const PlacedTree a{cube().view(), {}, 1};
        const PlacedTree b{cube().view(), pose_of(q, {0.03, -0.05, 0.5 - scale * (low + depth)}),
                           scale};
        const Penetration p =
            swapped ? penetration(b, a, {}, workspace) : penetration(a, b, {}, workspace);
        const double share = p.volume / (scale * scale * scale);
        const double force = p.translation_gradient.norm() / (scale * scale);
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
  const Asset off = testing::make_random_asset({500, 0.1, {3, -2, 1}, 2}, 6);
  for (int i = 0; i < 60; ++i) {
    const double scale = std::pow(10.0, i % 7 - 3);
    const Vector3d normal = random_direction(random);
    const PlacedField a{HalfSpaceField{normal, 0.1 * scale}, random_pose(random, scale), 0.7};
    const PlacedTree b{(i % 2 == 0 ? off : cube()).view(), random_pose(random, 0.5 * scale), scale};
    const Vector3d n = rotation(a.pose) * normal;
    double volume = 0, scale_of_force = 0;
    Vector3d force = Vector3d::Zero(), torque = force, moment = force;
    for (const testing::WorldSphere& s : testing::world_spheres(b, Measure::matched)) {
      const double d = 0.07 * scale - n.dot(s.centre - position(a.pose));
      const Cap c = cap(s.r, d);
      volume += c.volume;
      force -= c.derivative * n;
      scale_of_force += c.derivative;
      torque -= (s.centre - position(b.pose)).cross(c.derivative * n);
      moment += c.volume * s.centre - c.moment * n;
    }
    const Penetration p = penetration(a, b, {}, workspace);
    ASSERT_EQ(p.status, QueryStatus::ok);
    const double lever = 20 * scale;  // the farthest sphere
    EXPECT_NEAR(p.volume, volume, 1e-12 * volume + 1e-12 * scale * scale_of_force);
    EXPECT_LE((p.translation_gradient - force).norm(), 1e-11 * scale_of_force);
    EXPECT_LE((p.rotation_gradient - torque).norm(), 1e-11 * scale_of_force * lever);
    if (volume > 1e-6 * scale * scale * scale) {
      EXPECT_LE((p.centroid - moment / volume).norm(), 1e-9 * lever);
    }
    EXPECT_LE(p.volume_min, volume * (1 + 1e-12));
    EXPECT_GE(p.volume_max, volume * (1 - 1e-12));
  }
}

std::vector<std::pair<const char*, PenetrationSettings>> limits() {
  std::vector<std::pair<const char*, PenetrationSettings>> all;
  for (const std::uint32_t visits : {1u, 3u, 10u, 40u, 200u, 1000u}) {
    PenetrationSettings s;
    s.max_visits = visits;
    all.emplace_back("max_visits", s);
  }
  for (const double us : {1e-3, 1.0, 5.0, 20.0}) {
    PenetrationSettings s;
    s.deadline_us = us;
    all.emplace_back("deadline_us", s);
  }
  for (const double error : {0.5, 0.1, 0.01}) {
    PenetrationSettings s;
    s.relative_error = error;
    all.emplace_back("relative_error", s);
  }
  for (const double radius : {0.5, 0.1, 0.02}) {
    PenetrationSettings s;
    s.min_radius = radius;
    all.emplace_back("min_radius", s);
  }
  return all;
}

void expect_bounds(const char* name, const char* limit, const Penetration& got,
                   const Penetration& full, double relative_error) {
  EXPECT_NE(got.status, QueryStatus::invalid_input);
  EXPECT_LE(got.volume_min, full.volume * (1 + 1e-6)) << name << ' ' << limit;
  EXPECT_GE(got.volume_max, full.volume * (1 - 1e-6)) << name << ' ' << limit;
  EXPECT_LE(got.volume_min, got.volume) << name << ' ' << limit;
  EXPECT_GE(got.volume_max, got.volume) << name << ' ' << limit;
  EXPECT_TRUE(std::isfinite(got.volume_max) && got.translation_gradient.allFinite() &&
              got.rotation_gradient.allFinite() && got.centroid.allFinite())
      << name << ' ' << limit;
  if (relative_error > 0) {
    EXPECT_LE(got.volume_max - got.volume_min, (relative_error + 1e-4) * got.volume_max + 1e-15)
        << name;
  }
  if (got.status == QueryStatus::ok) {
    EXPECT_NEAR(got.volume, full.volume, 1e-6 * full.volume) << name << ' ' << limit;
  }
}

TEST(FieldQuery, LimitsKeepTrueBounds) {
  std::mt19937_64 random(25);
  Workspace large, tiny(64);
  for (const auto& [name, field] : fields()) {
    for (int i = 0; i < 6; ++i) {
      const PlacedField a{field, random_pose(random, 0.1), 1};
      const PlacedTree b{(i % 2 == 0 ? cube() : torus()).view(), random_pose(random, 0.15 * i),
                         0.8};
      const Penetration full = penetration(a, b, {}, large);
      for (const auto& [limit, settings] : limits())
        expect_bounds(name, limit, penetration(a, b, settings, large), full,
                      settings.relative_error);
      expect_bounds(name, "tiny", penetration(a, b, {}, tiny), full, 0);
    }
  }
}

TEST(FieldPairs, LimitsKeepTrueBounds) {
  std::mt19937_64 random(26);
  Workspace large, tiny(64);
  for (const Pair& pair : pairs()) {
    for (const FieldUse use : {FieldUse::automatic, FieldUse::always}) {
      for (int i = 0; i < 60; ++i) {
        const PlacedTree a{pair.a.view(), random_pose(random, 0), 1};
        const PlacedTree b{pair.b.view(), random_pose(random, (0.5 + 0.0133 * i) * pair.distance),
                           pair.scale_b};
        PenetrationSettings plain;
        plain.field = use;
        const Penetration full = penetration(a, b, plain, large);
        for (auto [limit, settings] : limits()) {
          settings.field = use;
          expect_bounds(pair.name, limit, penetration(a, b, settings, large), full,
                        settings.relative_error);
        }
        // As many visits as the lenses take, or about: none is left for the exact sum.
        PenetrationSettings lenses = plain;
        lenses.field = FieldUse::never;
        const std::uint32_t visits = penetration(a, b, lenses, large).node_visits;
        for (const std::uint32_t more : {0u, 1u, 2u, 3u, 5u}) {
          PenetrationSettings settings = plain;
          settings.max_visits = std::max(1u, visits + more - 1);
          expect_bounds(pair.name, "lenses' visits", penetration(a, b, settings, large), full, 0);
        }
        expect_bounds(pair.name, "tiny", penetration(a, b, plain, tiny), full, 0);
      }
    }
  }
}

void expect_shares(const char* name, const ContactPatches& got, const Penetration& whole,
                   std::span<const ContactPatch> patches) {
  EXPECT_EQ(got.penetration.volume, whole.volume) << name;
  EXPECT_EQ(got.penetration.status, whole.status) << name;
  EXPECT_EQ(got.penetration.node_visits, whole.node_visits) << name;
  EXPECT_EQ(got.penetration.translation_gradient, whole.translation_gradient) << name;
  EXPECT_EQ(got.penetration.rotation_gradient, whole.rotation_gradient) << name;
  // Where a stopped query has summed nothing yet there is nothing to divide.
  if (whole.status == QueryStatus::ok) {
    EXPECT_EQ(got.count > 0, whole.volume > 0) << name;
  }
  if (got.count == 0) return;
  double volume = 0, pull = 0, turn = 0;
  Vector3d force = Vector3d::Zero(), torque = force;
  for (const ContactPatch& patch : patches.first(got.count)) {
    volume += patch.volume;
    force += patch.force;
    torque += patch.torque;
    pull += patch.force.norm();
    turn += patch.torque.norm();
    EXPECT_TRUE(patch.normal.allFinite() && patch.centroid.allFinite());
    EXPECT_GE(patch.volume, 0) << name;
  }
  EXPECT_NEAR(volume, whole.volume, 1e-12 * whole.volume) << name;
  EXPECT_LE((force + whole.translation_gradient).norm(), 1e-12 * pull) << name;
  EXPECT_LE((torque + whole.rotation_gradient).norm(), 1e-12 * (turn + 2 * pull)) << name;
}

TEST(FieldQuery, PatchesAddUpToTheWhole) {
  Workspace workspace;
  std::mt19937_64 random(27);
  ContactPatch patches[12];
  for (const auto& [name, field] : fields()) {
    for (int i = 0; i < 8; ++i) {
      const PlacedField a{field, random_pose(random, 0.1), 1};
      const PlacedTree b{cube().view(), random_pose(random, 0.12 * i), 0.8};
      const Penetration whole = penetration(a, b, {}, workspace);
      const ContactPatches got = contact_patches(a, b, {}, workspace, patches);
      expect_shares(name, got, whole, patches);
    }
  }
}

TEST(FieldPairs, PatchesAddUpToTheWhole) {
  Workspace workspace;
  std::mt19937_64 random(28);
  ContactPatch patches[12];
  for (const Pair& pair : pairs()) {
    for (const FieldUse use : {FieldUse::automatic, FieldUse::always}) {
      for (int i = 0; i < 12; ++i) {
        const PlacedTree a{pair.a.view(), random_pose(random, 0.1), 1};
        const PlacedTree b{pair.b.view(), random_pose(random, (0.2 + 0.08 * i) * pair.distance),
                           pair.scale_b};
        PenetrationSettings settings;
        settings.field = use;
        ContactSettings contact;
        contact.field = use;
        // A stopped query is divided too.
        settings.max_visits = contact.max_visits = i % 3 == 0 ? 10u * static_cast<unsigned>(i) : 0;
        const Penetration whole = penetration(a, b, settings, workspace);
        expect_shares(pair.name, contact_patches(a, b, contact, workspace, patches), whole,
                      patches);
      }
    }
  }
}

/// Distance of a point from a field in its own frame, positive outside.
double outside_of(const Field& field, const Vector3d& x) {
  if (const auto* f = std::get_if<HalfSpaceField>(&field)) return f->normal.dot(x) - f->offset;
  if (const auto* f = std::get_if<BallField>(&field)) return x.norm() - f->radius;
  if (const auto* f = std::get_if<BoxField>(&field)) {
    const Vector3d q = x.cwiseAbs() - f->half_extents;
    return q.cwiseMax(0.0).norm() + std::min(0.0, q.maxCoeff());
  }
  if (const auto* f = std::get_if<CapsuleField>(&field)) {
    const double z = std::clamp(x.z(), -f->half_height, f->half_height);
    return (x - Vector3d(0, 0, z)).norm() - f->radius;
  }
  const auto& f = std::get<CylinderField>(field);
  const double side = x.head<2>().norm() - f.radius, end = std::abs(x.z()) - f.half_height;
  return std::hypot(std::max(side, 0.0), std::max(end, 0.0)) + std::min(0.0, std::max(side, end));
}

TEST(FieldQuery, SeparationIsTheNearestSpheres) {
  Workspace workspace;
  std::mt19937_64 random(29);
  for (const auto& [name, field] : fields()) {
    const std::string kind = name;
    if (kind == "terrain" || kind == "grid" || kind == "function") continue;
    const bool mesh = kind == "mesh";
    const double scale = 1.3;
    int apart = 0;
    for (int i = 0; i < 30; ++i) {
      const PlacedField a{field, random_pose(random, 0.3), scale};
      const PlacedTree b{cube().view(), random_pose(random, 0.1 + 0.08 * i), 0.5};
      const Separation got = separation(a, b, {}, workspace);
      ASSERT_EQ(got.status, QueryStatus::ok) << name;
      const Quaterniond q = rotation(a.pose).conjugate();
      const auto local = [&](const Vector3d& x) -> Vector3d {
        return q * (x - position(a.pose)) / scale;
      };
      double gap = std::numeric_limits<double>::infinity();
      if (mesh) {
        // The torus as its segments: by another query, against a ball field of its own.
        const Separation trees =
            separation(PlacedTree{torus().view(), a.pose, scale}, b, {}, workspace);
        EXPECT_LE(got.distance_min, trees.distance_max + 1e-9);
        EXPECT_GE(got.distance_max, trees.distance_min - 1e-9);
      } else {
        for (const testing::WorldSphere& s : testing::world_spheres(b, Measure::inner))
          gap = std::min(gap, scale * outside_of(field, local(s.centre)) - s.r);
        EXPECT_NEAR(got.distance, std::max(0.0, gap), 1e-9) << name;
        EXPECT_GE(got.distance_max, std::max(0.0, gap) - 1e-12) << name;
        // The cube's own corners tell the solids' distance from above, faces aside.
        double corners = std::numeric_limits<double>::infinity();
        for (int c = 0; c < 8; ++c) {
          const Vector3d x((c & 1) - 0.5, (c >> 1 & 1) - 0.5, (c >> 2) - 0.5);
          corners = std::min(corners, scale * outside_of(field, local(rotation(b.pose) * (0.5 * x) +
                                                                      position(b.pose))));
        }
        EXPECT_LE(got.distance_min, std::max(0.0, corners) + 1e-9) << name;
        if (kind == "half-space") {
          EXPECT_GE(got.distance_max, std::max(0.0, corners) - 1e-9);
        }
      }
      EXPECT_LE(got.distance_min, got.distance);
      if (!(got.distance > 0)) {
        EXPECT_EQ(got.normal, Vector3d::Zero()) << name;
        EXPECT_EQ(got.point_a, Vector3d::Zero()) << name;
        EXPECT_EQ(got.distance_max, 0) << name;
        continue;
      }
      ++apart;
      EXPECT_NEAR((got.point_b - got.point_a).norm(), got.distance, 1e-9) << name;
      EXPECT_NEAR(got.normal.dot(got.point_b - got.point_a), got.distance, 1e-9) << name;
      if (!mesh) {
        EXPECT_NEAR(scale * outside_of(field, local(got.point_a)), 0, 1e-9) << name;
      }
      double on = std::numeric_limits<double>::infinity();
      for (const testing::WorldSphere& s : testing::world_spheres(b, Measure::inner))
        on = std::min(on, std::abs((got.point_b - s.centre).norm() - s.r));
      EXPECT_LE(on, 1e-9) << name;
    }
    EXPECT_GT(apart, 3) << name;
  }
}

// Far over a large terrain whose heights are known to lie within bounds, nobody looks at all of it.
TEST(FieldQuery, SeparationFromALargeTerrain) {
  Workspace workspace;
  std::vector<float> heights(1000 * 1000);
  for (std::size_t i = 0; i < heights.size(); ++i) heights[i] = static_cast<float>(i % 7) * 0.001f;
  HeightField terrain;
  terrain.heights = heights.data();
  terrain.columns = terrain.rows = 1000;
  terrain.spacing[0] = terrain.spacing[1] = 0.01;
  terrain.lowest = 0, terrain.highest = 0.0061;
  for (const double z : {1.0, 3.0, 50.0}) {
    const PlacedTree b{cube().view(), pose_of(Quaterniond::Identity(), {5, 5, z}), 1};
    const Separation got = separation(PlacedField{terrain, {}, 1}, b, {}, workspace);
    double lowest = std::numeric_limits<double>::infinity();
    for (const testing::WorldSphere& s : testing::world_spheres(b, Measure::inner))
      lowest = std::min(lowest, s.centre.z() - s.r);
    // A ridge of triangles runs under every sphere, to within the grid's own spacing.
    EXPECT_GE(got.distance, lowest - 0.0061);
    EXPECT_LE(got.distance, lowest);
  }
}

// ---- what nobody should hand in

struct Garbage {
  double distance;
  Vector3d gradient;
  std::uint64_t after;  ///< looks that are answered well
  mutable std::uint64_t looks = 0;
};

FieldSample answer_garbage(const void* context, const Vector3d& x) noexcept {
  const Garbage& garbage = *static_cast<const Garbage*>(context);
  if (garbage.looks++ < garbage.after) return {0.1 - x.z(), Vector3d(0, 0, -1)};
  return {garbage.distance, garbage.gradient};
}

TEST(FieldHostile, FunctionsThatAnswerGarbage) {
  const testing::NoFloatTraps with_nan;
  Workspace workspace;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const Vector3d up = Vector3d::UnitZ();
  ContactPatch patches[4];
  for (const std::uint64_t after : {0ull, 5ull, 40ull}) {
    for (const Garbage& kind :
         {Garbage{nan, up, after}, Garbage{inf, up, after}, Garbage{-inf, up, after},
          Garbage{1e300, up, after}, Garbage{0, nan * up, after}, Garbage{0, inf * up, after},
          Garbage{0, Vector3d::Constant(1e300), after}, Garbage{-1e-3, 500 * up, after},
          Garbage{1e100, up, after}, Garbage{0, Vector3d::Zero(), after}}) {
      const PlacedField a{FunctionField{answer_garbage, &kind, 0}, {}, 1};
      const PlacedTree b{cube().view(), {}, 1};
      const bool sound = std::abs(kind.distance) <= 1e150 && kind.gradient.norm() <= 1e3;
      const Penetration p = penetration(a, b, {}, workspace);
      if (!sound) {
        EXPECT_EQ(p.status, QueryStatus::invalid_input) << kind.distance;
        EXPECT_EQ(p.volume, 0);
        EXPECT_EQ(p.volume_max, 0);
      }
      EXPECT_TRUE(std::isfinite(p.volume) && p.rotation_gradient.allFinite());
      kind.looks = 0;
      const Separation s = separation(a, b, {}, workspace);
      EXPECT_FALSE(std::isnan(s.distance) || std::isnan(s.distance_max)) << kind.distance;
      kind.looks = 0;
      const ContactPatches c = contact_patches(a, b, {}, workspace, patches);
      if (!sound) {
        EXPECT_EQ(c.count, 0u);
      }
      EXPECT_LE(c.count, 4u);
      kind.looks = 0;
    }
  }
}

TEST(FieldHostile, NumbersOutOfRange) {
  const testing::NoFloatTraps with_nan;
  Workspace workspace;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const float four[4] = {};
  HeightField terrain;
  terrain.heights = four, terrain.columns = terrain.rows = 2;
  DistanceGridField grid;
  const float eight[8] = {};
  grid.distances = eight;
  for (std::uint32_t& n : grid.size) n = 2;
  std::vector<Field> bad = {HalfSpaceField{Vector3d::Zero(), 0},
                            HalfSpaceField{Vector3d::Constant(nan), 0},
                            HalfSpaceField{Vector3d(0, 0, 2), 0},
                            HalfSpaceField{Vector3d::UnitZ(), nan},
                            HalfSpaceField{Vector3d::UnitZ(), inf},
                            BoxField{Vector3d(1, 0, 1)},
                            BoxField{Vector3d(1, -1, 1)},
                            BoxField{Vector3d(1, nan, 1)},
                            BoxField{Vector3d(1, inf, 1)},
                            BallField{0},
                            BallField{-1},
                            BallField{nan},
                            BallField{inf},
                            CapsuleField{-1, 1},
                            CapsuleField{1, -1},
                            CapsuleField{1, nan},
                            CapsuleField{nan, 1},
                            CylinderField{0, 1},
                            CylinderField{1, 0},
                            CylinderField{1, nan},
                            HeightField{},
                            DistanceGridField{},
                            FunctionField{},
                            MeshField{},
                            MeshField{testing::make_random_asset({10, 0.5, {}, 0}, 3).view()}};
  const Asset fieldless = testing::make_random_asset({10, 0.5, {}, 0}, 3);
  bad.back() = MeshField{fieldless.view()};
  const auto with = [&](auto base, auto change) {
    change(base);
    bad.push_back(base);
  };
  with(terrain, [](HeightField& f) { f.columns = 1; });
  with(terrain, [](HeightField& f) { f.rows = 0; });
  with(terrain, [](HeightField& f) { f.spacing[0] = 0; });
  with(terrain, [&](HeightField& f) { f.spacing[1] = nan; });
  with(terrain, [](HeightField& f) { f.lowest = 1, f.highest = 0; });
  with(terrain, [](HeightField& f) { f.heights = nullptr; });
  with(grid, [](DistanceGridField& f) { f.size[1] = 1; });
  with(grid, [](DistanceGridField& f) { f.spacing = -1; });
  with(grid, [&](DistanceGridField& f) { f.origin.x() = nan; });
  with(grid, [&](DistanceGridField& f) { f.error = nan; });
  with(grid, [](DistanceGridField& f) { f.distances = nullptr; });
  ContactPatch patches[4];
  const PlacedTree b{cube().view(), {}, 1};
  for (std::size_t i = 0; i < bad.size(); ++i) {
    const PlacedField a{bad[i], {}, 1};
    const PenetrationAndSeparation both = query(a, b, {}, workspace);
    EXPECT_EQ(both.penetration.status, QueryStatus::invalid_input) << i;
    EXPECT_EQ(both.separation.status, QueryStatus::invalid_input) << i;
    EXPECT_EQ(both.penetration.volume_max, 0) << i;
    EXPECT_EQ(contact_patches(a, b, {}, workspace, patches).count, 0u) << i;
  }
  const PlacedField good{BallField{1}, {}, 1};
  for (const double scale : {0.0, -1.0, nan, inf}) {
    EXPECT_EQ(penetration(PlacedField{BallField{1}, {}, scale}, b, {}, workspace).status,
              QueryStatus::invalid_input);
    EXPECT_EQ(penetration(good, {cube().view(), {}, scale}, {}, workspace).status,
              QueryStatus::invalid_input);
  }
  EXPECT_EQ(penetration(good, {TreeView(), {}, 1}, {}, workspace).status,
            QueryStatus::invalid_input);
  EXPECT_EQ(penetration(PlacedField{BallField{1}, {{nan, 0, 0, 0}, {0, 0, 0}}, 1}, b, {}, workspace)
                .status,
            QueryStatus::invalid_input);
  Workspace gone = std::move(workspace);
  EXPECT_EQ(penetration(good, b, {}, workspace).status, QueryStatus::invalid_input);
}

TEST(FieldHostile, TablesOfNoNumbers) {
  const testing::NoFloatTraps with_nan;
  Workspace workspace;
  for (const float value :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
        -std::numeric_limits<float>::infinity(), 3e38f}) {
    for (const bool all : {true, false}) {
      std::vector<float> values(125, all ? value : 0.1f);
      values[62] = values[12] = value;
      DistanceGridField grid;
      grid.distances = values.data();
      for (std::uint32_t& n : grid.size) n = 5;
      grid.origin = Vector3d::Constant(-1);
      grid.spacing = 0.5;
      HeightField terrain;
      terrain.heights = values.data();
      terrain.columns = terrain.rows = 5;
      terrain.spacing[0] = terrain.spacing[1] = 0.25;
      for (const Field& field : {Field(grid), Field(terrain)}) {
        const PlacedField a{field, {}, 1};
        for (const double z : {0.0, 0.5, -3.0}) {
          const PlacedTree b{cube().view(), pose_of(Quaterniond::Identity(), {0.1, 0.2, z}), 0.5};
          const Penetration p = penetration(a, b, {}, workspace);
          // Never a NaN that says it is an answer.
          const bool plain = std::isfinite(p.volume) && p.translation_gradient.allFinite() &&
                             p.rotation_gradient.allFinite() && p.centroid.allFinite();
          EXPECT_TRUE(plain || p.status == QueryStatus::invalid_input)
              << field.index() << ' ' << value << ' ' << all << ' ' << z;
          const Separation s = separation(a, b, {}, workspace);
          EXPECT_TRUE(!std::isnan(s.distance) || s.status == QueryStatus::invalid_input);
        }
      }
    }
  }
}

}  // namespace
}  // namespace ist
