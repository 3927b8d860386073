#include "mesh/resolve/resolve.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <random>
#include <string_view>
#include <thread>
#include <vector>

#include <ist/bake.h>
#include <ist/mesh.h>
#include <ist/solid.h>
#include <ist/types.h>

#include "support/mesh_table.h"
#include "support/shared_data.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

using testing::box_mesh;
using testing::joined;
using testing::MeshRow;
using testing::read_mesh_table;
using testing::shared_path;
using How = Resolution::How;
using Point = Eigen::Vector3d;

TriangleMesh cube_at(const Point& lower) { return box_mesh(lower, lower + Point::Ones()); }

ResolvedMesh resolved(const TriangleMesh& mesh) { return resolve(close_mesh(mesh, "mesh")); }

/// The mesh is changed, bounds `volume` and counts nothing twice any more; `twice` was.
void expect_resolved(const TriangleMesh& mesh, const double volume, const double twice) {
  const ResolvedMesh result = resolved(mesh);
  const Resolution& resolution = result.resolution;
  const MeshReport& report = result.mesh.report;
  ASSERT_EQ(resolution.how, How::resolved) << resolution.reason;
  EXPECT_NEAR(report.volume, volume, 1e-14 * report.bounds.volume());
  EXPECT_NEAR(resolution.counted_twice, twice, 1e-14 * report.bounds.volume());
  EXPECT_LE(resolution.moved, 1e-15 * report.bounds.diagonal().norm());
  EXPECT_TRUE(report.closed);
  const Resolution again = resolve(result.mesh).resolution;
  EXPECT_NE(again.how, How::unresolved) << again.reason;
  EXPECT_LE(again.counted_twice + again.counted_against, 1e-14 * report.bounds.volume());
}

/// Inside one means inside the other, except within `near` of the surface.
void expect_same_solid(const ClosedMesh& a, const ClosedMesh& b, const double near) {
  const auto of_a = make_solid(a), of_b = make_solid(b);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> share(-0.02, 1.02);
  std::size_t inside = 0;
  for (int i = 0; i < 1000; ++i) {
    const Point at(share(random), share(random), share(random));
    const Point p = a.report.bounds.min() + at.cwiseProduct(a.report.bounds.sizes());
    const double in_a = of_a->signed_distance(p), in_b = of_b->signed_distance(p);
    inside += in_a < 0 ? 1 : 0;
    if (std::abs(in_a) > near) {
      EXPECT_EQ(in_a < 0, in_b < 0) << p.transpose();
    }
  }
  EXPECT_GT(inside, 0u);
}

TEST(Resolve, OverlappingCubes) {
  expect_resolved(joined(cube_at({0, 0, 0}), cube_at({0.5, 0.25, 0.75})), 2 - 0.09375, 0.09375);
  const TriangleMesh three =
      joined(joined(box_mesh({0, 0, 0}, {4, 4, 4}), box_mesh({2, 1, 1}, {6, 3, 3})),
             box_mesh({3, 2, -1}, {5, 6, 5}));
  // 64 + 16 + 48, pairs 8 + 8 + 4, all three 2.
  expect_resolved(three, 128 - 20 + 2, 20 - 2);
}

TEST(Resolve, FacesInCommonPlanes) {
  expect_resolved(joined(cube_at({0, 0, 0}), cube_at({0.5, 0, 0})), 1.5, 0.5);
  expect_resolved(joined(cube_at({0, 0, 0}), cube_at({0.5, 0.5, 0})), 1.75, 0.25);
  expect_resolved(joined(cube_at({0, 0, 0}), box_mesh({0, 0, 0}, {0.5, 0.5, 0.5})), 1, 0.125);
  expect_resolved(joined(cube_at({0, 0, 0}), cube_at({1 - 0x1p-30, 0, 0})), 2 - 0x1p-30, 0x1p-30);
}

TEST(Resolve, ShellInAShell) {
  expect_resolved(joined(box_mesh({0, 0, 0}, {3, 3, 3}), cube_at({1, 1, 1})), 27, 1);
  const ResolvedMesh result = resolved(joined(box_mesh({0, 0, 0}, {3, 3, 3}), cube_at({1, 1, 1})));
  EXPECT_EQ(result.mesh.report.shells, 1u);
  EXPECT_EQ(result.resolution.moved, 0);
}

double area_of(const TriangleMesh& mesh) {
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Point& from = mesh.vertices[a];
    area += (mesh.vertices[b] - from).cross(mesh.vertices[c] - from).norm() / 2;
  }
  return area;
}

/// A prism of n sides and radius 1 about the z axis.
TriangleMesh prism(const std::uint32_t n, const double low, const double high, const double turn) {
  TriangleMesh mesh;
  for (const double z : {low, high})
    for (std::uint32_t i = 0; i < n; ++i) {
      const double angle = turn + 2 * 3.14159265358979 * i / n;
      mesh.vertices.emplace_back(std::cos(angle), std::sin(angle), z);
    }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.triangles.push_back({i, j, n + j});
    mesh.triangles.push_back({i, n + j, n + i});
    if (i < 1 || i + 1 >= n) continue;
    mesh.triangles.push_back({0, i + 1, i});
    mesh.triangles.push_back({n, n + i, n + i + 1});
  }
  return mesh;
}

/// A cavity that a prism fits into; its outer radius is 2.
TriangleMesh tube(const std::uint32_t n, const double low, const double high) {
  TriangleMesh mesh;
  mesh.vertices = joined(prism(n, low, high, 0), prism(n, low, high, 0)).vertices;
  const auto quad = [&](const std::uint32_t a, const std::uint32_t b, const std::uint32_t c,
                        const std::uint32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  for (std::uint32_t v = 2 * n; v < 4 * n; ++v) mesh.vertices[v].head<2>() *= 2;
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    quad(2 * n + i, 2 * n + j, 3 * n + j, 3 * n + i);
    quad(j, i, n + i, n + j);
    quad(i, j, 2 * n + j, 2 * n + i);
    quad(n + j, n + i, 3 * n + i, 3 * n + j);
  }
  return mesh;
}

/// Parts that touch, and the surface of their union.
struct Touching {
  TriangleMesh mesh;
  double volume, area, twice = 0;
};

std::vector<Touching> touching_parts() {
  const TriangleMesh cube = cube_at({0, 0, 0});
  const TriangleMesh row = joined(joined(cube, cube_at({0, 0, 1})), cube_at({1, 0, 0}));
  const TriangleMesh on_it =
      joined(box_mesh({0.3, 0.3, 1}, {0.6, 0.6, 1.5}), box_mesh({0.6, 0.1, 1}, {0.9, 0.6, 1.2}));
  const TriangleMesh inside =
      joined(box_mesh({0, 0, 0}, {3, 3, 3}), box_mesh({0, 1, 1}, {1, 2, 2}));
  constexpr std::uint32_t kSides = 13;
  const double disc = kSides / 2.0 * std::sin(2 * 3.14159265358979 / kSides);
  const double rim = 2 * kSides * std::sin(3.14159265358979 / kSides);
  return {
      {joined(cube, cube_at({0.3, 0.2, 1})), 2, 12 - 2 * 0.56},
      {joined(cube, cube_at({0, 0.5, 1})), 2, 12 - 2 * 0.5},
      {joined(box_mesh({-2, -0.5, 0}, {2, 0.5, 1}), box_mesh({-0.5, -2, 1}, {0.5, 2, 2})), 8, 34},
      {row, 3, 14},
      {joined(cube, on_it), 1 + 0.045 + 0.03, 6 + 1.2 * 0.5 + 1.6 * 0.2 - 2 * 0.3 * 0.2},
      {joined(inside, cube_at({1, 1, 1})), 27, 54, 2},
      {joined(tube(kSides, 0, 1), prism(kSides, 0, 1, 0)), 4 * disc, 8 * disc + 2 * rim},
      {joined(tube(kSides, 0, 1), prism(kSides, -0.4, 1.9, 0)), 4 * disc + 1.3 * disc,
       8 * disc + 2 * rim + 1.3 * rim},
  };
}

TEST(Resolve, PartsThatTouchAreOneSolidAtEveryTurn) {
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> by(-3, 3);
  for (const Touching& parts : touching_parts())
    for (int turn = 0; turn < 24; ++turn) {
      TriangleMesh mesh = parts.mesh;
      double scale = 1;
      if (turn > 0) {  // every fourth by right angles
        const Point angles = Point(by(random), by(random), by(random));
        const auto angle = [&](const int k) {
          return turn % 4 == 0 ? std::round(angles[k]) * std::acos(0.0) : angles[k];
        };
        const Eigen::Matrix3d turned = (Eigen::AngleAxisd(angle(0), Point::UnitX()) *
                                        Eigen::AngleAxisd(angle(1), Point::UnitY()) *
                                        Eigen::AngleAxisd(angle(2), Point::UnitZ()))
                                           .toRotationMatrix();
        scale = std::array{1.0, 0.001, 25.4}[static_cast<std::size_t>(turn) % 3];
        const Point to = turn % 2 == 0 ? Point(by(random), by(random), by(random)) : Point::Zero();
        for (Point& v : mesh.vertices) v = scale * (turned * v + to);
      }
      const ClosedMesh closed = close_mesh(mesh, "parts");
      const ResolvedMesh result = resolve(closed);
      ASSERT_NE(result.resolution.how, How::unresolved) << result.resolution.reason;
      const double cubed = scale * scale * scale;
      const double volume = parts.volume * cubed, area = parts.area * scale * scale;
      EXPECT_NEAR(result.resolution.counted_twice, parts.twice * cubed, 1e-11 * volume);
      EXPECT_GE(result.resolution.counted_twice, 0);
      EXPECT_NEAR(result.mesh.report.volume, volume, 1e-11 * volume) << turn;
      EXPECT_NEAR(area_of(result.mesh.mesh), area, 1e-9 * area) << "an inner wall, " << turn;
      const Asset asset = bake_mesh_only(closed);
      EXPECT_NEAR(asset.view().volume(), volume, 1e-11 * volume);
      if (turn % 6 > 1) continue;
      for (const Invariant& one : check(asset, closed))
        EXPECT_EQ(one.violations, 0u) << one.name << ' ' << one.worst;
    }
}

TEST(Resolve, WhatOnlyTouchesInEdgesAndCornersStaysAsItIs) {
  for (const Point& at :
       {Point(1, 0, 0), Point(1, 1, 0), Point(1, 1, 1), Point(1, 1, 0.5), Point(3, 0, 0)}) {
    const TriangleMesh mesh = joined(cube_at({0, 0, 0}), cube_at(at));
    const ClosedMesh closed = close_mesh(mesh, "cubes");
    const ResolvedMesh result = resolve(closed);
    EXPECT_EQ(result.resolution.how, How::as_it_is) << at.transpose();
    EXPECT_EQ(result.resolution.counted_twice, 0);
    EXPECT_EQ(result.mesh.mesh.vertices, closed.mesh.vertices);
    EXPECT_EQ(result.mesh.mesh.triangles, closed.mesh.triangles);
  }
  EXPECT_EQ(resolved(testing::icosphere_mesh(2)).resolution.how, How::as_it_is);
  // A cavity is no overlap.
  const TriangleMesh hollow =
      joined(box_mesh({0, 0, 0}, {3, 3, 3}), testing::inverted(cube_at({1, 1, 1})));
  EXPECT_EQ(resolved(hollow).resolution.how, How::as_it_is);
}

TEST(Resolve, PartsThatNothingMeetsKeepTheirTriangles) {
  const TriangleMesh apart = testing::icosphere_mesh(1);
  TriangleMesh far = apart;
  for (Point& v : far.vertices) v += Point(0.1, 9.3, 0);
  const ResolvedMesh result =
      resolved(joined(far, joined(cube_at({0, 0, 0}), cube_at({0.5, 0.25, 0.75}))));
  ASSERT_EQ(result.resolution.how, How::resolved);
  for (const Point& v : far.vertices)
    EXPECT_EQ(std::count(result.mesh.mesh.vertices.begin(), result.mesh.mesh.vertices.end(), v), 1);
}

/// One shell: a box's prism pushed through its own opposite wall.
TEST(Resolve, AShellThatCrossesItself) {
  TriangleMesh mesh = box_mesh({0, 0, 0}, {4, 4, 4});
  // The face z = 0 gets a square in its middle that is pulled through to z = 6.
  mesh.triangles.erase(mesh.triangles.begin(), mesh.triangles.begin() + 2);
  for (const double z : {0.0, 6.0})
    for (int i = 0; i < 4; ++i) mesh.vertices.emplace_back(i & 1 ? 3 : 1, i & 2 ? 3 : 1, z);
  const auto quad = [&](const std::uint32_t a, const std::uint32_t b, const std::uint32_t c,
                        const std::uint32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  quad(0, 8, 9, 1);  // the frame about the square; close_mesh() turns what faces wrongly
  quad(1, 9, 11, 3);
  quad(3, 11, 10, 2);
  quad(2, 10, 8, 0);
  quad(8, 9, 13, 12);  // walls of the hole
  quad(9, 11, 15, 13);
  quad(11, 10, 14, 15);
  quad(10, 8, 12, 14);
  quad(12, 13, 15, 14);  // its end, above the box
  ClosedMesh closed = close_mesh(mesh, "box with a hole pushed through its lid");
  ASSERT_EQ(closed.report.shells, 1u);
  EXPECT_NEAR(closed.report.volume, 64 - 24, 1e-12);
  const ResolvedMesh result = resolve(closed);
  ASSERT_EQ(result.resolution.how, How::resolved) << result.resolution.reason;
  EXPECT_NEAR(result.mesh.report.volume, 64 - 16, 1e-12);
  EXPECT_NEAR(result.resolution.counted_against, 8, 1e-12);
  EXPECT_NEAR(result.resolution.counted_twice, 0, 1e-12);
  expect_same_solid(closed, result.mesh, 1e-9);
}

TEST(Resolve, TorusThatCrossesItself) {
  // A tube along a curve that is cut by itself: three leaves, each through the middle.
  constexpr std::uint32_t kAlong = 120, kAround = 10;
  TriangleMesh knot;
  for (std::uint32_t i = 0; i < kAlong; ++i) {
    const double t = 2 * 3.14159265358979 * (i + 0.3) / kAlong;
    const double radius = 2 * std::cos(3 * t) + 0.1, slope = -6 * std::sin(3 * t);
    const Point centre(radius * std::cos(t), radius * std::sin(t), 0.2 * std::sin(t));
    const Point along = Point(slope * std::cos(t) - radius * std::sin(t),
                              slope * std::sin(t) + radius * std::cos(t), 0.2 * std::cos(t))
                            .normalized();
    const Point side = along.cross(Point::UnitZ()).normalized(), up = side.cross(along);
    for (std::uint32_t k = 0; k < kAround; ++k) {
      const double angle = 2 * 3.14159265358979 * k / kAround;
      knot.vertices.push_back(centre + 0.2 * (std::cos(angle) * side + std::sin(angle) * up));
    }
  }
  for (std::uint32_t i = 0; i < kAlong; ++i)
    for (std::uint32_t k = 0; k < kAround; ++k) {
      const std::uint32_t a = i * kAround + k, b = i * kAround + (k + 1) % kAround;
      const std::uint32_t c = (a + kAround) % (kAlong * kAround),
                          d = (b + kAround) % (kAlong * kAround);
      knot.triangles.push_back({a, b, d});
      knot.triangles.push_back({a, d, c});
    }
  const ClosedMesh closed = close_mesh(knot, "leaves");
  ASSERT_EQ(closed.report.shells, 1u);
  const ResolvedMesh result = resolve(closed);
  ASSERT_EQ(result.resolution.how, How::resolved) << result.resolution.reason;
  EXPECT_GT(result.resolution.counted_twice, 0.01);
  const auto solid = make_solid(closed);
  EXPECT_NEAR(result.mesh.report.volume, solid->volume(), 2 * solid->volume_error() + 1e-12);
  expect_same_solid(closed, result.mesh, 1e-9);
  // A spindle: dozens of triangles cross within rounding at two points of the axis.
  const ClosedMesh spindle = close_mesh(testing::torus_mesh(1, 1.5, 16, 12), "spindle");
  const ResolvedMesh without_core = resolve(spindle);
  EXPECT_EQ(without_core.resolution.how, How::resolved) << without_core.resolution.reason;
  expect_same_solid(spindle, without_core.mesh, 1e-9);
}

TEST(Resolve, RandomBoxesOnALattice) {
  std::mt19937_64 random(7);
  for (int round = 0; round < 60; ++round) {
    constexpr int kSize = 6;
    std::array<int, kSize* kSize* kSize> count = {};
    TriangleMesh mesh;
    for (std::uint64_t box = 2 + random() % 6; box > 0; --box) {
      std::array<int, 3> low, high;
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = static_cast<int>(random() % kSize);
        high[k] = low[k] + 1 + static_cast<int>(random() % static_cast<unsigned>(kSize - low[k]));
      }
      for (int z = low[2]; z < high[2]; ++z)
        for (int y = low[1]; y < high[1]; ++y)
          for (int x = low[0]; x < high[0]; ++x)
            ++count[static_cast<std::size_t>((z * kSize + y) * kSize + x)];
      mesh =
          joined(mesh, box_mesh(Point(low[0], low[1], low[2]), Point(high[0], high[1], high[2])));
    }
    const auto volume =
        std::count_if(count.begin(), count.end(), [](const int c) { return c > 0; });
    const ResolvedMesh result = resolved(mesh);
    ASSERT_NE(result.resolution.how, How::unresolved) << result.resolution.reason;
    EXPECT_NEAR(result.mesh.report.volume, double(volume), 1e-12) << round;
    // The same, turned: planes are common up to rounding only.
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(round + 0.1, Point(1, 2, 3).normalized()).toRotationMatrix();
    for (Point& v : mesh.vertices) v = turn * v;
    const ResolvedMesh turned = resolved(mesh);
    ASSERT_NE(turned.resolution.how, How::unresolved) << turned.resolution.reason;
    EXPECT_NEAR(turned.mesh.report.volume, double(volume), 1e-11) << round;
  }
}

TEST(Resolve, CrumpledSurfaces) {
  std::mt19937_64 random(11);
  std::size_t changed = 0;
  for (int round = 0; round < 24; ++round) {
    TriangleMesh mesh = testing::icosphere_mesh(round % 2);
    for (Point& v : mesh.vertices)
      for (double& x : v) x = static_cast<double>(random() % 6);
    try {
      const ClosedMesh closed = close_mesh(mesh, "crumpled");
      const ResolvedMesh result = resolve(closed);
      ASSERT_NE(result.resolution.how, How::unresolved) << result.resolution.reason;
      changed += result.resolution.how == How::resolved ? 1 : 0;
      expect_same_solid(closed, result.mesh, 1e-9);
    } catch (const Error&) {  // flat, or not orientable where vertices have become one
    }
  }
  EXPECT_GE(changed, 10u);
}

/// Balls that overlap.
ClosedMesh balls(const int count, const int level) {
  std::mt19937_64 random(13);
  std::uniform_real_distribution<double> by(-1, 1);
  TriangleMesh mesh;
  for (int i = 0; i < count; ++i) {
    TriangleMesh ball = testing::icosphere_mesh(level);
    const Point shift(by(random), by(random), by(random));
    for (Point& v : ball.vertices) v += shift;
    mesh = joined(mesh, ball);
  }
  return close_mesh(mesh, "balls");
}

TEST(Resolve, SameBytesForAnyNumberOfThreads) {
  const ClosedMesh closed = balls(6, 2);
  std::optional<ResolvedMesh> first;
  for (const std::size_t threads : {1, 2, 4}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    ResolvedMesh result = resolve(closed);
    ASSERT_EQ(result.resolution.how, How::resolved);
    if (!first) {
      first = std::move(result);
      continue;
    }
    EXPECT_EQ(result.mesh.mesh.vertices, first->mesh.mesh.vertices);
    EXPECT_EQ(result.mesh.mesh.triangles, first->mesh.mesh.triangles);
    EXPECT_EQ(result.resolution.counted_twice, first->resolution.counted_twice);
  }
}

/// A hundred thousand pairs: reported on the caller's thread, and stopped on request.
TEST(Resolve, ReportsAndIsCancelled) {
  const ClosedMesh closed = balls(26, 3);
  ASSERT_GT(closed.meeting_pairs->size(), 35'000u);
  std::vector<double> told;
  const auto caller = std::this_thread::get_id();
  const ProgressCallback listen = [&](const Progress& now) {
    EXPECT_STREQ(now.stage, "resolve");
    EXPECT_EQ(std::this_thread::get_id(), caller);
    told.push_back(now.fraction);
    return true;
  };
  const ResolvedMesh result = resolve(closed, listen);
  EXPECT_EQ(result.resolution.how, How::resolved) << result.resolution.reason;
  ASSERT_GT(told.size(), 4u);
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_EQ(told.front(), 0);
  EXPECT_EQ(told.back(), 1);
  EXPECT_EQ(result.mesh.mesh.triangles, resolve(closed).mesh.mesh.triangles);
  std::size_t asked = 0;
  const ProgressCallback until_third = [&](const Progress&) { return ++asked < 3; };
  try {
    resolve(closed, until_third);
    FAIL() << "not cancelled";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "resolve: cancelled");
  }
  EXPECT_EQ(asked, 3u);
  // So are bakes, however they begin.
  const ProgressCallback no = [](const Progress& now) {
    return std::string_view(now.stage) != "resolve";
  };
  EXPECT_THROW(bake(closed, {.max_spheres = 100}, no), Error);
  EXPECT_THROW(bake_mesh_only(closed, 0, no), Error);
  EXPECT_THROW(bake_to_error(closed, {}, {}, no), Error);
  // Parts that meet nothing are skipped.
  EXPECT_EQ(resolve(close_mesh(testing::cube_mesh(), "cube"), no).resolution.how, How::as_it_is);
}

TEST(Resolve, WhatItCannotDoItSays) {
  // A winding number that is nowhere 1, which no closed mesh of close_mesh() has.
  ClosedMesh inside_out = testing::closed(testing::inverted(testing::cube_mesh()), "inside out");
  const ResolvedMesh result = resolve(inside_out);
  EXPECT_EQ(result.resolution.how, How::unresolved);
  EXPECT_FALSE(result.resolution.reason.empty());
  EXPECT_EQ(result.mesh.mesh.triangles, inside_out.mesh.triangles);
  // Pairs that are not the mesh's.
  ClosedMesh wrong = close_mesh(testing::overlapping_cubes_mesh(), "cubes");
  wrong.meeting_pairs->resize(wrong.meeting_pairs->size() / 2);
  EXPECT_EQ(resolve(wrong).resolution.how, How::unresolved);
}

ClosedMesh wild_mesh(const std::string& file) {
  return close_mesh(load_mesh(shared_path("meshes/wild/" + file).string()), file);
}

TEST(Resolve, TheWildOnes) {
  IST_NEEDS_SHARED("meshes/wild/MESHES.csv");
  std::size_t found = 0;
  for (const MeshRow& row : read_mesh_table(shared_path("meshes/wild/MESHES.csv").string())) {
    if (row.at("kind").find("meets itself") == std::string::npos) continue;
    ++found;
    const ResolvedMesh result = resolve(wild_mesh(row.at("file")));
    EXPECT_NE(result.resolution.how, How::unresolved) << row.at("file") << result.resolution.reason;
    const Resolution again = resolve(result.mesh).resolution;
    EXPECT_LE(again.counted_twice + again.counted_against, 1e-14 * result.mesh.report.volume);
  }
  EXPECT_GE(found, 41u);
}

TEST(Resolve, WhatResolvedPairsShareIsTheOraclesVolume) {
  IST_NEEDS_SHARED("oracle/wild/truth_wild.csv");
  const auto poses = read_mesh_table(shared_path("oracle/wild/poses_wild.csv").string());
  const auto truths = read_mesh_table(shared_path("oracle/wild/truth_wild.csv").string());
  ASSERT_EQ(poses.size(), truths.size());
  std::size_t compared = 0;
  for (std::size_t i = 0; i < poses.size(); i += 3) {
    const auto number = [&](const char* name) { return std::stod(poses[i].at(name)); };
    const std::string &a = poses[i].at("meshA"), &b = poses[i].at("meshB");
    // The oracle's reader of .dae files uses float.
    if ((a + b).find(".dae") != std::string::npos) continue;
    TriangleMesh placed = resolve(wild_mesh(b)).mesh.mesh;
    const Eigen::Matrix3d turn =
        Eigen::Quaterniond(number("qw"), number("qx"), number("qy"), number("qz"))
            .toRotationMatrix();
    for (Point& v : placed.vertices)
      v = turn * (number("scale_b") * v) + Point(number("tx"), number("ty"), number("tz"));
    const Resolution both = resolved(joined(resolve(wild_mesh(a)).mesh.mesh, placed)).resolution;
    const double truth = std::stod(truths[i].at("volume"));
    EXPECT_NEAR(both.counted_twice, truth, 1e-9 * truth) << i << both.reason;
    ++compared;
  }
  EXPECT_GE(compared, 20u);
}

}  // namespace
}  // namespace ist
