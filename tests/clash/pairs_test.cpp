#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/pose_eigen.h>
#include <ist/types.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <random>

#include "clash/clash.h"
#include "mesh/samples/samples.h"
#include "support/exact_pair.h"
#include "support/mated_rows.h"
#include "support/random_mates.h"
#include "support/turned_solid.h"
#include "support/turns.h"

// All pairs of an assembly: against single queries, CAD parts at their mates, and what follows from
// boxes by hand.

namespace ist {
namespace {

using Eigen::Vector3d;

TriangleMesh box(const Vector3d& low, const Vector3d& high) {
  TriangleMesh mesh = make_sample("cube");
  for (Vector3d& v : mesh.vertices)
    for (int k = 0; k < 3; ++k) v[k] = v[k] > 0 ? high[k] : low[k];
  return mesh;
}

/// Rounded like a file of float32.
TriangleMesh rounded(TriangleMesh mesh) {
  for (Vector3d& v : mesh.vertices) v = v.cast<float>().cast<double>();
  return mesh;
}

std::vector<Clash> clashes(const std::vector<ClashPart>& parts, double clearance = 0,
                           double touch_within = -1) {
  return find_clashes(parts, {clearance, touch_within, 2});
}

TEST(ClashPairs, MatedPartsTouchAndAMillionthOverlaps) {
  IST_NEEDS_SHARED("oracle/mated/poses.csv");
  std::map<std::string, Asset> assets;
  const auto part = [&](const std::string& name, const Pose& pose) {
    auto found = assets.find(name);
    if (found == assets.end())
      found = assets
                  .emplace(name, testing::surface(load_mesh(testing::mated_mesh_path(name)),
                                                  name.c_str()))
                  .first;
    return ClashPart{name, {found->second.view(), pose, 1}, kFloat64};
  };
  int touching = 0, overlapping = 0, duplicates = 0;
  for (const testing::MatedRow& row : testing::read_mated_rows()) {
    SCOPED_TRACE(row.name + " moved by " + std::to_string(row.moved));
    const std::vector<ClashPart> parts = {part(row.mesh_a, {}), part(row.mesh_b, row.pose)};
    const std::vector<Clash> found = clashes(parts);
    const double smaller = std::min(parts[0].solid.asset.volume(), parts[1].solid.asset.volume());
    if (row.volume > 0) {
      ASSERT_EQ(found.size(), 1u);
      ++overlapping;
      EXPECT_EQ(found[0].kind, ClashKind::overlapping);
      EXPECT_NEAR(found[0].volume, row.volume, 1e-12 * smaller);
      EXPECT_GT(found[0].depth, 0);
      const bool copy = row.name.ends_with("in_place") && row.moved < 1e-8;
      EXPECT_EQ(found[0].duplicate, copy);
      duplicates += copy ? 1 : 0;
    } else if (row.moved == 0 || row.name == "pin_in_hole") {
      ASSERT_EQ(found.size(), 1u);
      ++touching;
      EXPECT_EQ(found[0].kind, ClashKind::touching);
      EXPECT_GT(found[0].contact_area, 0);
      EXPECT_EQ(found[0].volume, 0);
      EXPECT_EQ(found[0].depth, 0);
    }
  }
  EXPECT_EQ(touching + overlapping, 90);
  EXPECT_GE(touching, 15);
  EXPECT_EQ(duplicates, 4);
}

TEST(ClashPairs, AMateWithinTheToleranceHasTheFacesArea) {
  IST_NEEDS_SHARED("oracle/mated/poses.csv");
  const std::vector<testing::MatedRow> rows = testing::read_mated_rows();
  std::map<std::string, double> areas;
  int seen = 0;
  for (const testing::MatedRow& row : rows) {
    if (row.name != "bracket_on_plate" && row.name != "tube_in_tube" &&
        row.name != "brick_on_brick")
      continue;
    if (row.moved > 1e-5) continue;
    const Asset a = testing::surface(load_mesh(testing::mated_mesh_path(row.mesh_a)));
    const Asset b = testing::surface(load_mesh(testing::mated_mesh_path(row.mesh_b)));
    const auto found = clashes({{"a", {a.view(), {}, 1}}, {"b", {b.view(), row.pose, 1}}}, 0, 2e-6);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].kind, ClashKind::touching) << row.name << row.moved << " " << found[0].depth;
    if (row.moved == 0) areas[row.name] = found[0].contact_area;
    EXPECT_NEAR(found[0].contact_area, areas[row.name], 1e-3 * areas[row.name]) << row.name;
    ++seen;
  }
  EXPECT_EQ(seen, 9);
}

// Around a pin no one direction is that of the contact.
TEST(ClashPairs, APinRoundedToFloatTouchesAllRound) {
  IST_NEEDS_SHARED("oracle/mated/poses.csv");
  std::mt19937_64 random(11);
  const std::vector<testing::MatedRow> rows = testing::read_mated_rows();
  const auto mate = std::find_if(rows.begin(), rows.end(), [](const testing::MatedRow& row) {
    return row.name == "tube_in_tube" && row.moved == 0;
  });
  const TriangleMesh outer = load_mesh(testing::mated_mesh_path(mate->mesh_a)),
                     inner = load_mesh(testing::mated_mesh_path(mate->mesh_b));
  const Eigen::Isometry3d in_outer = to_isometry(mate->pose);
  double area = 0;
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(i);
    Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
    const Eigen::Quaterniond turn =
        i % 2 == 1 ? testing::random_turn(random) : testing::right_angled_turns()[i];
    if (i > 0) place = Eigen::Translation3d(20, 30, 40) * turn;
    const auto placed = [&](TriangleMesh mesh, const Eigen::Isometry3d& at) {
      for (Vector3d& v : mesh.vertices) v = place * (at * v);
      return i == 0 ? mesh : rounded(std::move(mesh));
    };
    const Asset a = testing::surface(placed(outer, Eigen::Isometry3d::Identity())),
                b = testing::surface(placed(inner, in_outer));
    const std::vector<Clash> found =
        clashes({{"a", {a.view(), {}, 1}, kFloat32}, {"b", {b.view(), {}, 1}, kFloat32}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].kind, ClashKind::touching) << found[0].depth;
    if (i == 0) area = found[0].contact_area;
    EXPECT_NEAR(found[0].contact_area, area, 1e-3 * area);
  }
}

TEST(ClashPairs, FlushFacesRoundedToFloatTouch) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> any(0, 1);
  int noisy = 0;
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(i);
    // Two boxes with a common face, anywhere and turned: half of them by right angles.
    const double size = 30, where = 100 * any(random);
    const Eigen::Quaterniond turn =
        i % 2 == 0 ? testing::random_turn(random) : testing::right_angled_turns()[i % 24];
    const auto turned = [&](TriangleMesh mesh) {
      for (Vector3d& v : mesh.vertices) v = turn * (v + Vector3d(where, 2 * where, 0.1));
      return rounded(std::move(mesh));
    };
    const Asset a = testing::surface(turned(box({0, 0, 0}, {size, size, 0.3}))),
                b = testing::surface(turned(box({5, 5, 0.3}, {25, 25, 1.7})));
    const std::vector<ClashPart> parts = {{"a", {a.view(), {}, 1}, kFloat32},
                                          {"b", {b.view(), {}, 1}, kFloat32}};
    const std::vector<Clash> found = clashes(parts);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].kind, ClashKind::touching) << found[0].depth;
    EXPECT_NEAR(found[0].contact_area, 400, 0.4);
    noisy += found[0].volume > 0 ? 1 : 0;
    // A tenth deeper is no noise, and neither is a gap of a tenth.
    for (const double by : {-0.1, 0.1}) {
      std::vector<ClashPart> moved = parts;
      const Vector3d t = turn * Vector3d(0, 0, by);
      std::copy_n(t.data(), 3, moved[1].solid.pose.t);
      const std::vector<Clash> other = clashes(moved);
      ASSERT_EQ(other.size(), by < 0 ? 1u : 0u);
      if (by < 0) {
        EXPECT_EQ(other[0].kind, ClashKind::overlapping);
        EXPECT_NEAR(other[0].depth, 0.1, 1e-3);
        EXPECT_LE((other[0].direction - turn * Vector3d::UnitZ()).norm(), 1e-4);
      }
    }
  }
  EXPECT_GE(noisy, 10);
}

TEST(ClashPairs, ADeepCornerIsNoTouchHoweverLargeTheFaces) {
  // A plate that lies flush by a millionth, with a pin that reaches a tenth further.
  TriangleMesh plate = box({0, 0, 0}, {100, 100, 1});
  const TriangleMesh pin = box({50, 50, -0.1}, {50.01, 50.01, 0.5});
  const auto first = static_cast<std::uint32_t>(plate.vertices.size());
  plate.vertices.insert(plate.vertices.end(), pin.vertices.begin(), pin.vertices.end());
  for (const auto& t : pin.triangles)
    plate.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  const Asset a = testing::surface(box({-5, -5, -1}, {105, 105, 1e-6})),
              b = testing::surface(std::move(plate)),
              flat = testing::surface(box({0, 0, 0}, {100, 100, 1}));
  const auto kind = [&](const Asset& upper) {
    return clashes({{"a", {a.view(), {}, 1}}, {"b", {upper.view(), {}, 1}}}, 0, 1e-5)[0].kind;
  };
  EXPECT_EQ(kind(flat), ClashKind::touching);
  EXPECT_EQ(kind(b), ClashKind::overlapping);
}

// If facets of both meet along their edges, some parts of the overlap are rounding.
// The volume changes in no direction: rounding alone has one.
TEST(ClashPairs, ABarThroughAPlateHasNoDirection) {
  std::mt19937_64 random(13);
  for (int i = 0; i < 24; ++i) {
    SCOPED_TRACE(i);
    const Eigen::Quaterniond turn =
        i % 2 == 1 ? testing::random_turn(random) : Eigen::Quaterniond::Identity();
    const double size = std::pow(10.0, i % 4);
    const Asset bar = testing::surface(box({-1, -2, -5}, {1, 2, 5})),
                plate = testing::surface(box({-4 * size, -5 * size, -1}, {4 * size, 5 * size, 1}));
    const std::vector<Clash> found = clashes(
        {{"bar", {bar.view(), testing::turned(turn, {}), 1}, kFloat64},
         {"plate", {plate.view(), testing::turned(turn, {.t = {0.3, 0.7, 1.1}}), 1}, kFloat64}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_LE(found[0].volume_min, 16);
    EXPECT_GE(found[0].volume_max, 16);
    EXPECT_EQ(found[0].direction, Vector3d::Zero());
  }
}

TEST(ClashPairs, ABallInItsRaceIsAsDeepAsItsFacets) {
  constexpr double kRadius = 3, kRace = 15;
  using Counts = std::array<std::uint32_t, 4>;
  for (const auto& [around, meridians, parallels, groove] :
       {Counts{24, 12, 8, 8}, Counts{32, 24, 12, 12}, Counts{64, 16, 8, 12}}) {
    SCOPED_TRACE(around);
    std::vector<Eigen::Vector2d> ring = {{16, -4}}, ball;
    for (std::uint32_t i = 0; i <= groove; ++i) {
      const double a = 0.425 * std::numbers::pi * (2.0 * i / groove - 1);
      const Eigen::Vector2d p(kRace + kRadius * std::cos(a), kRadius * std::sin(a));
      if (p.x() > 16) ring.push_back(p);
    }
    ring.insert(ring.end(), {{16, 4}, {21, 4}, {21, -4}});
    std::reverse(ring.begin(), ring.end());
    for (std::uint32_t i = 0; i <= parallels; ++i) {
      const double a = std::numbers::pi * i / parallels;
      const bool pole = i % parallels == 0;
      ball.emplace_back(pole ? 0 : kRadius * std::sin(a), kRadius * std::cos(a));
    }
    TriangleMesh race = testing::turned_solid(ring, around);
    for (Vector3d& v : race.vertices) v.x() -= kRace;
    const Asset a = testing::surface(rounded(std::move(race))),
                b = testing::surface(rounded(testing::turned_solid(ball, meridians)));
    const auto found = clashes({{"a", {a.view(), {}, 1}}, {"b", {b.view(), {}, 1}}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_GT(found[0].volume, 1e-4);
    EXPECT_LT(found[0].depth, 0.05);
  }
}

TEST(ClashPairs, AllPairsAreThoseOfSingleQueries) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  const Asset gear = testing::surface(make_sample("gear")),
              cube = testing::surface(make_sample("cube")),
              nut = testing::surface(make_sample("nut"));
  std::vector<ClashPart> parts;
  for (int i = 0; i < 60; ++i) {
    Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
    place.linear() = testing::random_turn(random).toRotationMatrix();
    place.translation() = 14 * Vector3d(any(random), any(random), any(random));
    if (i % 3 == 0) place.translation() = place.translation().array().round();
    if (i % 4 == 0) place.linear().setIdentity();
    const Asset& asset = i % 3 == 0 ? cube : i % 3 == 1 ? gear : nut;
    parts.push_back(
        {std::to_string(i), {asset.view(), to_pose(place), 0.4 + 0.3 * (i % 3)}, kFloat64});
  }
  constexpr double kClearance = 0.5;
  std::map<std::pair<std::size_t, std::size_t>, ClashKind> expected;
  Workspace workspace;
  for (std::size_t a = 0; a < parts.size(); ++a)
    for (std::size_t b = a + 1; b < parts.size(); ++b) {
      const Penetration p = testing::exactly(parts[a].solid, parts[b].solid, workspace);
      const Separation s = separation(parts[a].solid, parts[b].solid, {}, workspace);
      if (p.volume > 0)
        expected[{a, b}] = ClashKind::overlapping;
      else if (s.distance < kClearance)
        expected[{a, b}] = p.touching ? ClashKind::touching : ClashKind::apart;
    }
  const std::vector<Clash> found = clashes(parts, kClearance);
  ASSERT_EQ(found.size(), expected.size());
  auto next = expected.begin();
  int kinds[3] = {};
  for (const Clash& clash : found) {
    EXPECT_EQ(std::pair(clash.a, clash.b), next->first);
    EXPECT_EQ(clash.kind, next->second);
    ++kinds[static_cast<int>(clash.kind)];
    ++next;
  }
  EXPECT_GE(kinds[0], 20);
  EXPECT_GE(kinds[2], 5);
  // The same bits for any number of threads.
  for (const unsigned threads : {1u, 3u, 16u}) {
    const std::vector<Clash> again = find_clashes(parts, {kClearance, -1, threads});
    ASSERT_EQ(again.size(), found.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(again[i].a, found[i].a);
      for (double Clash::*const number : {&Clash::volume, &Clash::volume_min, &Clash::depth,
                                          &Clash::distance_max, &Clash::contact_area})
        EXPECT_EQ(std::memcmp(&(again[i].*number), &(found[i].*number), sizeof(double)), 0);
      EXPECT_EQ(again[i].centroid, found[i].centroid);
    }
  }
}

TEST(ClashPairs, AnInvalidPoseIsRefusedByName) {
  const Asset cube = testing::surface(make_sample("cube"));
  for (const PlacedAsset& wrong :
       {PlacedAsset{cube.view(), {{1, 0, 0, 0}, {std::nan(""), 0, 0}}, 1},
        PlacedAsset{cube.view(), {{0, 0, 0, 0}, {}}, 1}, PlacedAsset{cube.view(), {}, 0},
        PlacedAsset{AssetView{}, {}, 1}}) {
    try {
      clashes({{"fine", {cube.view(), {}, 1}}, {"wrong", wrong}});
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).find("wrong: "), 0u) << error.what();
    }
  }
}

}  // namespace
}  // namespace ist
