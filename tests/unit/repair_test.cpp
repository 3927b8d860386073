#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <random>
#include <set>
#include <string>

#include <ist/mesh.h>
#include <ist/types.h>

#include "mesh/connectivity/edge_table.h"
#include "mesh/repair.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

using namespace testing;

ClosedMesh repaired(const TriangleMesh& mesh) {
  EXPECT_THROW(close_mesh(mesh, "part"), Error);
  const ClosedMesh closed = close_mesh(mesh, "part", OpenMeshPolicy::repair);
  EXPECT_TRUE(closed.report.repaired);
  EXPECT_TRUE(std::any_of(closed.report.notes.begin(), closed.report.notes.end(),
                          [](const std::string& note) { return note.find("repair:") == 0; }));
  EXPECT_NO_THROW(close_mesh(closed.mesh, "part again"));
  return closed;
}

TEST(Repair, ClosedMeshIsLeftAlone) {
  const ClosedMesh closed = close_mesh(cube_mesh(), "cube", OpenMeshPolicy::repair);
  EXPECT_FALSE(closed.report.repaired);
  EXPECT_EQ(closed.mesh.triangles, cube_mesh().triangles);
}

TEST(Repair, HolesAreCapped) {
  TriangleMesh cube = cube_mesh();
  cube.triangles.erase(cube.triangles.begin(), cube.triangles.begin() + 2);  // a whole side
  const ClosedMesh closed = repaired(cube);
  EXPECT_EQ(closed.report.filled_holes, 1u);
  EXPECT_EQ(closed.report.boundary_edges, 4u);  // as it came
  EXPECT_DOUBLE_EQ(closed.report.volume, 1);
  TriangleMesh tube = torus_mesh(2, 0.5, 24, 12);
  std::erase_if(tube.triangles, [](const auto& t) { return t[0] / 12 == 3 || t[0] / 12 == 12; });
  EXPECT_EQ(repaired(tube).report.filled_holes, 4u);
}

/// Boxes side by side, whose common walls exist once, with any orientation.
TEST(Repair, LayersLoseTheirInnerWallsAndKeepTheirOutside) {
  std::mt19937_64 random(5);
  for (const std::array<int, 3>& cells : {std::array{2, 1, 1}, {4, 1, 1}, {2, 2, 1}, {3, 2, 2}})
    for (int turn = 0; turn < 4; ++turn) {
      TriangleMesh mesh;
      const auto face = [&](Eigen::Vector3d at, const int k, const double thickness) {
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        for (const int corner : {0, 1, 3, 2}) {
          Eigen::Vector3d p = at;
          p[(k + 1) % 3] += corner & 1;
          p[(k + 2) % 3] += corner >> 1;
          p[0] *= thickness;
          mesh.vertices.push_back(p);
        }
        const bool turned = random() % 2 == 0;
        for (const std::array<std::uint32_t, 3>& t : {std::array{0u, 1u, 2u}, {0u, 2u, 3u}})
          mesh.triangles.push_back(
              {first + t[0], first + t[turned ? 2 : 1], first + t[turned ? 1 : 2]});
      };
      const double thickness = turn % 2 == 0 ? 1 : 0.03;
      for (int k = 0; k < 3; ++k) {
        std::array<int, 3> end = cells;
        ++end[static_cast<std::size_t>(k)];
        for (int x = 0; x < end[0]; ++x)
          for (int y = 0; y < end[1]; ++y)
            for (int z = 0; z < end[2]; ++z) face(Eigen::Vector3d(x, y, z), k, thickness);
      }
      std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
      if (turn > 1) {
        const Eigen::Matrix3d turned =
            Eigen::AngleAxisd(turn, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
        for (Eigen::Vector3d& v : mesh.vertices) v = turned * v;
      }
      const ClosedMesh closed = close_mesh(mesh, "layers", OpenMeshPolicy::repair);
      const double volume = cells[0] * cells[1] * cells[2] * thickness;
      EXPECT_NEAR(closed.report.volume, volume, 1e-12 * volume) << cells[0] << turn;
      ASSERT_TRUE(closed.report.judged);
      EXPECT_GT(closed.report.judged->confidence, 0.95);
    }
}

TEST(Repair, CracksAreStitched) {
  std::mt19937_64 random(1);
  const TriangleMesh torus = torus_mesh(1, 0.25, 48, 24);
  TriangleMesh cracked;
  for (const auto& t : torus.triangles) {
    for (const auto v : t) {
      const auto jitter = [&] { return 1e-6 * (static_cast<double>(random() % 2001) / 1000 - 1); };
      cracked.vertices.push_back(torus.vertices[v] + Eigen::Vector3d(jitter(), jitter(), jitter()));
    }
    const auto first = static_cast<std::uint32_t>(cracked.vertices.size() - 3);
    cracked.triangles.push_back({first, first + 1, first + 2});
  }
  const ClosedMesh closed = repaired(cracked);
  EXPECT_EQ(closed.mesh.vertices.size(), torus.vertices.size());
  EXPECT_EQ(closed.mesh.triangles.size(), torus.triangles.size());
  EXPECT_EQ(closed.report.filled_holes, 0u);
}

TEST(Repair, TJunctionsAreSplit) {
  TriangleMesh cube = box_mesh(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones());
  cube.vertices.push_back({0.5, 0, 0});
  cube.vertices.push_back({0.25, 0, 0});
  for (auto& t : cube.triangles)
    if (t == std::array<std::uint32_t, 3>{0, 1, 5}) t = {0, 9, 5};
  cube.triangles.push_back({9, 8, 5});
  cube.triangles.push_back({8, 1, 5});
  const ClosedMesh closed = repaired(cube);
  EXPECT_DOUBLE_EQ(closed.report.volume, 1);
  EXPECT_EQ(closed.report.filled_holes, 0u);
  EXPECT_EQ(closed.mesh.triangles.size(), 16u);  // two splits on either side of the edge
}

TEST(Repair, FinsAndSheetsAreDropped) {
  TriangleMesh mesh = cube_mesh();
  mesh.vertices.push_back({2, 2, 0});
  mesh.vertices.push_back({2, 2, 1});
  mesh.triangles.push_back({3, 7, 8});  // a fin of two triangles on the edge 3–7
  mesh.triangles.push_back({7, 9, 8});
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const Eigen::Vector3d& v : {Eigen::Vector3d(5, 0, 0), Eigen::Vector3d(6, 0, 0),
                                   Eigen::Vector3d(6, 1, 0), Eigen::Vector3d(5, 1, 0)})
    mesh.vertices.push_back(v);
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
  const ClosedMesh closed = repaired(mesh);
  EXPECT_DOUBLE_EQ(closed.report.volume, 1);
  EXPECT_EQ(closed.mesh.triangles, cube_mesh().triangles);
}

TEST(Repair, ABodyWithAHoleKeepsWhatAFinHangsOn) {
  // The hole has more open edges than the fin has.
  TriangleMesh mesh = box_mesh(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(2));
  std::erase_if(mesh.triangles, [](const auto& t) { return t[0] == 4; });  // z = 2
  mesh.vertices.push_back({-1, -1, 0.5});
  mesh.triangles.push_back({0, 4, 8});
  const ClosedMesh closed = repaired(mesh);
  EXPECT_DOUBLE_EQ(closed.report.volume, 8);
  EXPECT_EQ(closed.mesh.vertices.size(), 8u);
}

TEST(Repair, TellsWhetherTheClosedMeshMeetsItself) {
  // A post stands in the open side of a box: only the cap meets it.
  TriangleMesh box = box_mesh(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(4));
  std::erase_if(box.triangles, [](const auto& t) { return t[0] == 4; });  // z = 4
  const ClosedMesh empty = repaired(box);
  EXPECT_FALSE(empty.report.meets_itself);
  const ClosedMesh post = repaired(joined(box, box_mesh({1, 1, 1}, {2, 2, 5})));
  EXPECT_EQ(post.report.self_intersections, 0u);  // as it came
  EXPECT_TRUE(post.report.meets_itself);
  EXPECT_EQ(post.report.shells, 2u);
}

TEST(Repair, WhatEnclosesNothingFailsWithAReason) {
  TriangleMesh triangle;
  triangle.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  triangle.triangles = {{0, 1, 2}};
  TriangleMesh fins = triangle;
  fins.vertices.push_back({0, -1, 1});
  fins.vertices.push_back({0, -1, -1});
  fins.triangles.push_back({0, 1, 3});
  fins.triangles.push_back({0, 1, 4});
  for (const TriangleMesh& mesh : {triangle, fins}) {
    try {
      close_mesh(mesh, "part", OpenMeshPolicy::repair);
      FAIL() << "made a solid of nothing";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("part: cannot be repaired"), std::string::npos)
          << error.what();
    }
  }
}

TEST(Repair, RandomHolesAlwaysEndInAClosedMeshOrAReason) {
  std::mt19937_64 random(2);
  int closed = 0;
  for (int round = 0; round < 60; ++round) {
    TriangleMesh mesh = round % 2 == 0 ? icosphere_mesh(2) : torus_mesh(1, 0.4, 16, 9);
    const std::size_t keep_of_ten = 3 + random() % 7;
    std::erase_if(mesh.triangles, [&](const auto&) { return random() % 10 >= keep_of_ten; });
    for (auto& t : mesh.triangles)
      if (random() % 8 == 0) std::swap(t[0], t[1]);
    try {
      const ClosedMesh result = close_mesh(mesh, "part", OpenMeshPolicy::repair);
      EXPECT_NO_THROW(close_mesh(result.mesh, "again"));
      EXPECT_GT(result.report.volume, 0);
      ++closed;
    } catch (const Error&) {
    }
  }
  EXPECT_GT(closed, 20);
}

TEST(BorderLoops, RunAlongEveryOddEdgeOnce) {
  std::mt19937_64 random(3);
  for (int round = 0; round < 40; ++round) {
    TriangleMesh mesh = icosphere_mesh(2);
    std::erase_if(mesh.triangles, [&](const auto&) { return random() % 3 == 0; });
    const EdgeTable edges(mesh.triangles);
    std::set<std::pair<std::uint32_t, std::uint32_t>> odd;
    for (std::size_t e = 0; e < edges.size(); ++e)
      if (edges.sides(e).size() % 2 == 1) odd.insert({edges.low(e), edges.high(e)});
    for (const BorderLoop& loop : border_loops(edges)) {
      EXPECT_GE(loop.vertices.size(), 3u);
      EXPECT_EQ(std::set(loop.vertices.begin(), loop.vertices.end()).size(), loop.vertices.size());
      for (std::size_t i = 0; i < loop.vertices.size(); ++i) {
        const std::pair<std::uint32_t, std::uint32_t> edge =
            std::minmax(loop.vertices[i], loop.vertices[(i + 1) % loop.vertices.size()]);
        EXPECT_EQ(odd.erase(edge), 1u);
      }
    }
    EXPECT_TRUE(odd.empty());
  }
}

}  // namespace
}  // namespace ist
