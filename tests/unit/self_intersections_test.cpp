#include "mesh/connectivity/self_intersections.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include <ist/mesh.h>
#include <ist/types.h>

#include "mesh/connectivity/surface_reduction.h"
#include "mesh/connectivity/weld.h"
#include "mesh/mesh_solid.h"
#include "mesh/resolve/resolve.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

using Pairs = std::vector<std::array<std::uint32_t, 2>>;

/// Exact test of every pair; results without it must agree.
Pairs all_pairs(const TriangleMesh& mesh) {
  const auto& [vertices, triangles, declared, notes] = mesh;
  const std::vector<std::uint32_t> spread = spread_fans(vertices, triangles);
  Pairs pairs;
  for (std::uint32_t i = 0; i < triangles.size(); ++i)
    for (std::uint32_t j = i + 1; j < triangles.size(); ++j) {
      if (is_degenerate(vertices, triangles[i]) || is_degenerate(vertices, triangles[j])) continue;
      const bool met = meet_elsewhere(vertices, triangles[i], triangles[j]);
      EXPECT_EQ(met, meet_elsewhere(vertices, triangles[j], triangles[i]));
      if (met) {
        pairs.push_back({i, j});
        EXPECT_FALSE(seen_apart(vertices, triangles[i], triangles[j]));
        EXPECT_FALSE(seen_apart(vertices, triangles[j], triangles[i]));
        for (const std::uint32_t v : triangles[i])
          for (const std::uint32_t w : triangles[j]) EXPECT_FALSE(v == w && spread[v] != 0);
      }
    }
  return pairs;
}

void expect_all_found(const TriangleMesh& mesh) {
  const Pairs pairs = all_pairs(mesh);
  for (const std::size_t threads : {1, 4}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const auto found = find_self_intersections(mesh.vertices, mesh.triangles);
    ASSERT_TRUE(found && found->pairs);
    EXPECT_EQ(found->count, pairs.size());
    EXPECT_EQ(*found->pairs, pairs);
  }
  // Many are known not to meet each other.
  std::vector<std::uint8_t> apart(mesh.triangles.size(), 1);
  for (const auto& [a, b] : pairs)
    if (apart[a] != 0) apart[b] = 0;
  const auto found = find_self_intersections(mesh.vertices, mesh.triangles, apart);
  ASSERT_TRUE(found && found->pairs);
  EXPECT_EQ(*found->pairs, pairs);
}

/// Intersections of an addition to a large mesh are searched only nearby.
TEST(SelfIntersections, OfFewAddedTriangles) {
  TriangleMesh mesh = torus_mesh(2, 0.7, 60, 30);
  std::vector<std::uint8_t> apart(mesh.triangles.size(), 1);
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {{1, 0, 0}, {3, 0.01, 0.02}, {2, 0.3, 0.1}});
  mesh.triangles.push_back({first, first + 1, first + 2});
  apart.push_back(0);
  const auto found = find_self_intersections(mesh.vertices, mesh.triangles, apart);
  const auto all = find_self_intersections(mesh.vertices, mesh.triangles);
  ASSERT_TRUE(found && all);
  EXPECT_GT(all->count, 2);
  EXPECT_EQ(*found->pairs, *all->pairs);
  EXPECT_EQ(find_self_intersections(mesh.vertices, mesh.triangles,
                                    std::vector<std::uint8_t>(apart.size(), 1))
                ->count,
            0);
}

/// Triangles between corners of a small lattice: many touch exactly.
TriangleMesh lattice_soup(std::mt19937_64& random, const std::size_t corners,
                          const std::size_t triangles) {
  TriangleMesh soup;
  const auto coordinate = [&] { return static_cast<double>(random() % 9); };
  for (std::size_t v = 0; v < corners; ++v)
    soup.vertices.emplace_back(coordinate(), coordinate(), coordinate());
  const auto corner = [&] { return static_cast<std::uint32_t>(random() % corners); };
  for (std::size_t t = 0; t < triangles; ++t)
    soup.triangles.push_back({corner(), corner(), corner()});
  return weld(soup, 0);
}

/// A square grid over which heights are drawn, and drawn sideways too.
TriangleMesh crumpled_sheet(std::mt19937_64& random, const std::uint32_t n, const double sideways) {
  std::uniform_real_distribution<double> by(-1, 1);
  TriangleMesh sheet;
  for (std::uint32_t y = 0; y < n; ++y)
    for (std::uint32_t x = 0; x < n; ++x)
      sheet.vertices.emplace_back(x + sideways * by(random), y + sideways * by(random),
                                  sideways * by(random));
  for (std::uint32_t y = 0; y + 1 < n; ++y)
    for (std::uint32_t x = 0; x + 1 < n; ++x) {
      const std::uint32_t v = y * n + x;
      sheet.triangles.push_back({v, v + 1, v + n + 1});
      sheet.triangles.push_back({v, v + n + 1, v + n});
    }
  return sheet;
}

TEST(SelfIntersections, FindsWhatAllPairsFind) {
  std::mt19937_64 random(5);
  for (int round = 0; round < 20; ++round) expect_all_found(lattice_soup(random, 60, 80));
  for (int round = 0; round < 2; ++round) expect_all_found(lattice_soup(random, 200, 300));
  for (const double sideways : {0.0, 0.1, 0.4, 0.6, 1.0, 3.0})
    for (const double offset : {0.0, 1e6}) {
      TriangleMesh sheet = crumpled_sheet(random, 11, sideways);
      for (Eigen::Vector3d& v : sheet.vertices) v.array() += offset;
      expect_all_found(sheet);
      // Turned, so that what was flat is so up to rounding.
      const Eigen::Matrix3d turn =
          Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
      for (Eigen::Vector3d& v : sheet.vertices) v = turn * v;
      expect_all_found(sheet);
    }
}

void expect_handed_over(const TriangleMesh& mesh, const std::size_t at_least) {
  const ClosedMesh closed = close_mesh(mesh, "mesh", OpenMeshPolicy::repair);
  ASSERT_TRUE(closed.meeting_pairs);
  EXPECT_EQ(*closed.meeting_pairs, all_pairs(closed.mesh));
  EXPECT_EQ(closed.report.meets_itself, !closed.meeting_pairs->empty());
  EXPECT_GE(closed.meeting_pairs->size(), at_least);
}

TEST(SelfIntersections, TheClosedMeshKeepsThem) {
  const TriangleMesh two = testing::overlapping_cubes_mesh();
  expect_handed_over(two, 1);
  expect_handed_over(testing::box_mesh({0, 0, 0}, {1, 1, 1}), 0);
  // Triangles without area come first and are dropped.
  TriangleMesh dropped = two;
  dropped.triangles.insert(dropped.triangles.begin(), {{0, 0, 1}, {1, 2, 1}});
  dropped.triangles.insert(dropped.triangles.begin() + 7, {3, 3, 3});
  expect_handed_over(dropped, 1);
  // One face twice; one face missing.
  TriangleMesh copied = two;
  copied.triangles.insert(copied.triangles.begin(), two.triangles[3]);
  expect_handed_over(copied, 1);
  TriangleMesh open = two;
  open.triangles.erase(open.triangles.begin());
  expect_handed_over(open, 1);
}

TEST(SelfIntersections, TheSolidTakesThemWhereNothingIsRounded) {
  TriangleMesh two = testing::overlapping_cubes_mesh();
  ClosedMesh closed = close_mesh(two, "two cubes");
  const MeshSolid exact(closed);
  ASSERT_NE(exact.meeting_pairs(), nullptr);
  EXPECT_EQ(*exact.meeting_pairs(), *closed.meeting_pairs);
  for (Eigen::Vector3d& v : two.vertices)
    if (v[0] == 0) v[0] = 1e-20;
  EXPECT_EQ(MeshSolid(close_mesh(two, "rounded")).meeting_pairs(), nullptr);
  closed.meeting_pairs->push_back({0, static_cast<std::uint32_t>(closed.mesh.triangles.size())});
  EXPECT_THROW(MeshSolid{closed}, Error);
  closed.meeting_pairs.reset();
  EXPECT_EQ(MeshSolid(closed).meeting_pairs(), nullptr);
}

TEST(SelfIntersections, FansThatGoOnceAround) {
  // n triangles about vertex 0, `turns` times around, rising by `rise` at every other spoke.
  const auto fan = [](const std::uint32_t n, const int turns, const double rise) {
    TriangleMesh mesh;
    mesh.vertices.emplace_back(0, 0, 0);
    for (std::uint32_t i = 0; i < n; ++i) {
      const double angle = 2 * 3.14159265358979 * turns * i / n;
      mesh.vertices.emplace_back(std::cos(angle), std::sin(angle), i % 2 == 0 ? rise : -rise);
      mesh.triangles.push_back({0, 1 + i, 1 + (i + 1) % n});
    }
    return mesh;
  };
  const auto is_spread = [](const TriangleMesh& mesh) {
    return spread_fans(mesh.vertices, mesh.triangles)[0] != 0;
  };
  EXPECT_TRUE(is_spread(fan(3, 1, 0.1)));
  EXPECT_TRUE(is_spread(fan(4, 1, 0)));  // spokes opposite to the first
  EXPECT_TRUE(is_spread(fan(6, 1, 0)));
  EXPECT_TRUE(is_spread(fan(6, 1, 0.3)));
  EXPECT_TRUE(is_spread(fan(32, 1, 0.1)));
  EXPECT_TRUE(is_spread(fan(10'000, 1, 0)));
  EXPECT_TRUE(is_spread(fan(10'000, 1, 1e-6)));
  EXPECT_FALSE(is_spread(fan(10'001, 2, 0)));
  for (const std::uint32_t n : {5u, 7u, 9u, 12u, 15u, 31u}) {
    EXPECT_FALSE(is_spread(fan(n, 2, 0.1))) << n;
    if (n > 6) {
      EXPECT_FALSE(is_spread(fan(n, 3, 0.1))) << n;
    }
  }
  TriangleMesh open = fan(6, 1, 0);
  open.triangles.pop_back();
  EXPECT_FALSE(is_spread(open));
  TriangleMesh turned = fan(6, 1, 0);
  std::swap(turned.triangles[2][1], turned.triangles[2][2]);
  EXPECT_FALSE(is_spread(turned));
  TriangleMesh twice = fan(6, 1, 0);
  for (std::size_t t = 0; t < 6; ++t) twice.triangles.push_back(twice.triangles[t]);
  EXPECT_FALSE(is_spread(twice));
  TriangleMesh folded = fan(6, 1, 0);
  folded.vertices[2] = folded.vertices[4] * 0.9 + Eigen::Vector3d(0, 0, 0.1);
  EXPECT_FALSE(is_spread(folded));
}

TEST(SelfIntersections, PairsByHand) {
  const std::vector<Eigen::Vector3d> v = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0},    {2, 2, 0},
                                          {1, 1, 0}, {1, 1, 1}, {3, 3, 1},    {0, 0, 1},
                                          {1, 0, 0}, {3, 0, 0}, {.5, .5, -1}, {-1, 0, 0}};
  const auto meet = [&](Triangle a, Triangle b) { return meet_elsewhere(v, a, b); };
  EXPECT_FALSE(meet({0, 1, 2}, {1, 3, 2}));   // neighbours in a plane
  EXPECT_TRUE(meet({0, 1, 2}, {0, 1, 3}));    // folded onto each other
  EXPECT_TRUE(meet({0, 1, 2}, {2, 1, 0}));    // the same, backwards
  EXPECT_FALSE(meet({0, 1, 2}, {0, 1, 7}));   // a hinge
  EXPECT_TRUE(meet({0, 1, 2}, {4, 5, 6}));    // a corner touches a side
  EXPECT_FALSE(meet({0, 1, 2}, {5, 6, 7}));   // above
  EXPECT_TRUE(meet({0, 1, 2}, {8, 9, 5}));    // a side lies along a side
  EXPECT_TRUE(meet({0, 1, 2}, {0, 5, 10}));   // shares a corner and passes through
  EXPECT_FALSE(meet({0, 1, 2}, {0, 7, 11}));  // shares a corner only
}

/// A cylinder, or a cone, of n sides, whose ends are fans about a point of the axis or a corner.
TriangleMesh fan_body(const std::uint32_t n, const bool cone, const bool about_corner) {
  TriangleMesh mesh;
  for (const double z : {-0.3, 0.3})
    for (std::uint32_t i = 0; i < n; ++i) {
      const double angle = 2 * 3.14159265358979 * i / n;
      mesh.vertices.emplace_back(std::cos(angle), std::sin(angle), z);
    }
  const std::uint32_t low = 2 * n, high = 2 * n + 1;
  mesh.vertices.emplace_back(0, 0, -0.3);
  mesh.vertices.emplace_back(0, 0, cone ? 0.9 : 0.3);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    if (cone) {
      mesh.triangles.push_back({high, i, j});
    } else {
      mesh.triangles.push_back({i, j, n + i});
      mesh.triangles.push_back({j, n + j, n + i});
      if (!about_corner) mesh.triangles.push_back({high, n + i, n + j});
      if (about_corner && i != 0 && j != 0) mesh.triangles.push_back({n, n + i, n + j});
    }
    if (!about_corner) mesh.triangles.push_back({low, j, i});
    if (about_corner && i != 0 && j != 0) mesh.triangles.push_back({0, j, i});
  }
  return weld(mesh, 0);
}

TEST(SelfIntersections, OfNeedles) {
  TriangleMesh other = testing::needle_tube(50, 0.2);
  for (Eigen::Vector3d& v : other.vertices) v = Eigen::Vector3d(v.y(), 0.6 * v.z(), v.x());
  const TriangleMesh two = testing::joined(testing::needle_tube(60, 0.5), other);
  expect_all_found(two);
  EXPECT_GT(find_self_intersections(two.vertices, two.triangles)->count, 100u);
  // More pairs of axis-aligned boxes meet than are examined.
  const TriangleMesh large = testing::needle_tube(10'000, 0.3);
  const auto none = find_self_intersections(large.vertices, large.triangles);
  ASSERT_TRUE(none);
  EXPECT_EQ(none->count, 0u);
}

TEST(SelfIntersections, OfLargeFans) {
  std::mt19937_64 random(55);
  std::normal_distribution<double> any;
  for (const bool cone : {false, true})
    for (const bool about_corner : {false, true})
      for (const bool turned : {false, true}) {
        SCOPED_TRACE(::testing::Message() << cone << about_corner << turned);
        const Eigen::Quaterniond turn =
            turned ? Eigen::Quaterniond(any(random), any(random), any(random), any(random))
                         .normalized()
                   : Eigen::Quaterniond::Identity();
        // Larger than any search of all pairs could be.
        TriangleMesh large = fan_body(cone && about_corner ? 4'000 : 12'000, cone, about_corner);
        for (Eigen::Vector3d& v : large.vertices) v = turn * v;
        const auto none = find_self_intersections(large.vertices, large.triangles);
        ASSERT_TRUE(none);
        EXPECT_EQ(none->count, 0u);
        // A spike through it is found.
        TriangleMesh pierced = fan_body(80, cone, about_corner);
        const auto first = static_cast<std::uint32_t>(pierced.vertices.size());
        for (const auto& [x, y, z] : {std::array{0.5, 0.1, 1.0},
                                      {0.52, 0.13, -1.0},
                                      {0.45, 0.12, -1.0},
                                      {0.48, 0.05, -1.0}})
          pierced.vertices.emplace_back(x, y, z);
        for (const auto& t : {Triangle{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}})
          pierced.triangles.push_back({first + t[0], first + t[1], first + t[2]});
        for (Eigen::Vector3d& v : pierced.vertices) v = turn * v;
        expect_all_found(pierced);
        EXPECT_GT(find_self_intersections(pierced.vertices, pierced.triangles)->count, 3u);
      }
}

/// Cylinders of n sides on top of each other, each turned against the one below: their ends lie in
/// one plane and share its middle, and all their corners where `turn` is 0.
TriangleMesh stacked_fans(const std::uint32_t n, const std::uint32_t count, const double turn) {
  TriangleMesh all;
  for (std::uint32_t i = 0; i < count; ++i) {
    TriangleMesh one = fan_body(n, false, false);
    const Eigen::AngleAxisd about(i * turn, Eigen::Vector3d::UnitZ());
    for (Eigen::Vector3d& v : one.vertices) {
      const double z = (v.z() > 0 ? 1.0 : 0.0) + double(i);
      v = about * v;
      v.z() = z;
    }
    all = testing::joined(all, one);
  }
  return weld(all, 0);
}

TEST(SelfIntersections, OfFansInOnePlane) {
  for (const double turn : {0.0, 0.01, 0.3}) {
    SCOPED_TRACE(turn);
    expect_all_found(stacked_fans(70, 3, turn));
    // Pairs about a middle are a hundred million.
    constexpr std::uint32_t kMany = 10'000;
    const TriangleMesh large = stacked_fans(kMany, 2, turn);
    const auto found = find_self_intersections(large.vertices, large.triangles);
    ASSERT_TRUE(found);
    EXPECT_GE(found->count, kMany);
  }
}

/// Walls of n sides in all directions, whose boxes along the axes meet each other.
TriangleMesh sunburst(const std::uint32_t n, const double height) {
  TriangleMesh walls;
  for (const double z : {0.0, height})
    for (std::uint32_t i = 0; i < n; ++i) {
      const double angle = 2 * 3.14159265358979 * i / n, radius = i % 2 == 0 ? 1 : 0.1;
      walls.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    walls.triangles.push_back({i, j, n + j});
    walls.triangles.push_back({i, n + j, n + i});
  }
  return walls;
}

TEST(SelfIntersections, OfASunburst) {
  const Eigen::Quaterniond turn = Eigen::Quaterniond(0.3, -0.5, 0.2, 0.8).normalized();
  for (const bool turned : {false, true}) {
    SCOPED_TRACE(turned);
    const auto placed = [&](TriangleMesh mesh) {
      for (Eigen::Vector3d& v : mesh.vertices)
        if (turned) v = turn * v;
      return mesh;
    };
    expect_all_found(placed(sunburst(60, 1)));
    // Needles that cross others, a little and a lot.
    for (const double by : {1e-3, 0.37}) {
      const Eigen::AngleAxisd off(by * 2 * 3.14159265358979 / 80, Eigen::Vector3d(0.1, 0, 1));
      TriangleMesh other = sunburst(80, 0.005);
      for (Eigen::Vector3d& v : other.vertices) v = off * v + Eigen::Vector3d(0, 0, 0.004);
      const TriangleMesh two = placed(testing::joined(sunburst(80, 0.005), other));
      expect_all_found(two);
      EXPECT_GT(find_self_intersections(two.vertices, two.triangles)->count, 50u);
    }
  }
  TriangleMesh large = sunburst(24'000, 1);
  for (Eigen::Vector3d& v : large.vertices) v = turn * v;
  const auto none = find_self_intersections(large.vertices, large.triangles);
  ASSERT_TRUE(none);
  EXPECT_EQ(none->count, 0u);
}

TEST(SelfIntersections, FansInOnePlaneAreOneSolid) {
  for (const double turn : {0.0, 1e-3, 0.3}) {
    const ClosedMesh stack = close_mesh(stacked_fans(1'000, 2, turn), "stack");
    const ResolvedMesh one = resolve(stack);
    EXPECT_NE(one.resolution.how, Resolution::How::unresolved) << one.resolution.reason;
    const double each = 0.5 * 1'000 * std::sin(2 * 3.14159265358979 / 1'000);
    EXPECT_NEAR(MeshSolid(one).volume(), 2 * each, 1e-9) << turn;
    EXPECT_EQ(one.mesh.report.shells, 1u);
  }
}

}  // namespace
}  // namespace ist
