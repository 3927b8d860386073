#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include <ist/mesh.h>

#include "mesh/connectivity/edge_table.h"
#include "mesh/connectivity/shells.h"
#include "mesh/connectivity/weld.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

using namespace testing;

TriangleMesh moved(TriangleMesh mesh, const double scale, const Eigen::Vector3d& by) {
  for (auto& v : mesh.vertices) v = v * scale + by;
  return mesh;
}

/// Some shells with cavities, apart from and within each other; oriented right.
TriangleMesh random_solid(std::mt19937_64& random) {
  TriangleMesh mesh;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d place(5. * i, static_cast<double>(random() % 3), 0);
    const auto shell = [&]() -> TriangleMesh {
      switch (random() % 3) {
        case 0:
          return cube_mesh();
        case 1:
          return icosphere_mesh(static_cast<int>(random() % 3));
        default:
          return torus_mesh(0.7, 0.25, 7 + static_cast<std::uint32_t>(random() % 5), 6);
      }
    };
    mesh = joined(mesh, moved(shell(), 1, place));
    if (random() % 2 == 0) continue;
    // A box around it: the shell becomes its cavity, sometimes with a core.
    TriangleMesh family = box_mesh(Eigen::Vector3d::Constant(-2), Eigen::Vector3d::Constant(2));
    family = joined(family, inverted(icosphere_mesh(2)));
    if (random() % 2 == 0)
      family = joined(family, moved(cube_mesh(), 0.5, Eigen::Vector3d::Zero()));
    mesh = joined(mesh, moved(family, 1, place + Eigen::Vector3d(0, 20, 0)));
  }
  return mesh;
}

/// The same surface with vertices and triangles in another order and other first corners.
TriangleMesh shuffled(const TriangleMesh& mesh, std::mt19937_64& random) {
  std::vector<std::uint32_t> place(mesh.vertices.size());
  std::iota(place.begin(), place.end(), 0u);
  std::shuffle(place.begin(), place.end(), random);
  TriangleMesh result;
  result.vertices.resize(mesh.vertices.size());
  for (std::size_t v = 0; v < place.size(); ++v) result.vertices[place[v]] = mesh.vertices[v];
  for (auto t : mesh.triangles) {
    std::rotate(t.begin(), t.begin() + static_cast<std::ptrdiff_t>(random() % 3), t.end());
    result.triangles.push_back({place[t[0]], place[t[1]], place[t[2]]});
  }
  std::shuffle(result.triangles.begin(), result.triangles.end(), random);
  return result;
}

bool is_balanced(const TriangleMesh& mesh) {
  return !find_unbalanced_edge(mesh.triangles, EdgeTable(mesh.triangles));
}

TEST(CloseMeshProperty, OrderDoesNotMatter) {
  std::mt19937_64 random(1);
  for (int round = 0; round < 20; ++round) {
    const TriangleMesh solid = random_solid(random);
    const MeshReport a = close_mesh(solid, "a").report;
    const MeshReport b = close_mesh(shuffled(solid, random), "b").report;
    EXPECT_EQ(a.flipped_components, 0u);
    EXPECT_EQ(b.flipped_components, 0u);
    EXPECT_EQ(a.cavities, b.cavities);
    EXPECT_EQ(a.components, b.components);
    EXPECT_EQ(a.self_intersections, b.self_intersections);
    EXPECT_NEAR(a.volume, b.volume, 1e-12 * a.volume);
    EXPECT_EQ(a.notes, b.notes);
  }
}

TEST(CloseMeshProperty, RandomFlipsAreUndone) {
  std::mt19937_64 random(2);
  for (int round = 0; round < 20; ++round) {
    // Within a shell, faces may be flipped at random; between cavity and shell, orientation is
    // meaning. So the solid here has none.
    TriangleMesh mesh;
    for (int i = 0; i < 3; ++i)
      mesh = joined(
          mesh, moved(i == 1 ? torus_mesh(1, 0.3, 9, 7) : icosphere_mesh(i), 1, {4. * i, 0, 0}));
    const double volume = close_mesh(mesh, "a").report.volume;
    for (auto& t : mesh.triangles)
      if (random() % 2 == 0) std::swap(t[0], t[1]);
    const ClosedMesh closed = close_mesh(shuffled(mesh, random), "b");
    EXPECT_NEAR(closed.report.volume, volume, 1e-12 * volume);
    EXPECT_TRUE(is_balanced(closed.mesh));
  }
}

TEST(CloseMeshProperty, ClosingTwiceChangesNothing) {
  std::mt19937_64 random(3);
  for (int round = 0; round < 10; ++round) {
    const ClosedMesh once = close_mesh(shuffled(random_solid(random), random), "a");
    const ClosedMesh twice = close_mesh(once.mesh, "a");
    EXPECT_EQ(once.mesh.vertices, twice.mesh.vertices);
    EXPECT_EQ(once.mesh.triangles, twice.mesh.triangles);
  }
}

TEST(CloseMeshProperty, ScaleAndOffsetDoNotMatter) {
  std::mt19937_64 random(4);
  for (int round = 0; round < 5; ++round) {
    const TriangleMesh solid = random_solid(random);
    const MeshReport a = close_mesh(solid, "a").report;
    for (const double scale : {0x1p-30, 0x1p-10, 3., 0x1p20}) {
      for (const double offset : {0., 1e3, 1e6}) {
        const MeshReport b =
            close_mesh(moved(solid, scale, Eigen::Vector3d::Constant(offset * scale)), "b").report;
        EXPECT_EQ(a.components, b.components);
        EXPECT_EQ(a.cavities, b.cavities);
        EXPECT_EQ(a.flipped_components, b.flipped_components);
        EXPECT_EQ(a.degenerate_triangles, b.degenerate_triangles);
        EXPECT_NEAR(b.volume / std::pow(scale, 3), a.volume, 1e-8 * a.volume);
        if (offset == 0 && scale != 3) {
          EXPECT_EQ(a.self_intersections, b.self_intersections);
        }
      }
    }
  }
}

TEST(Weld, FirstVertexWinsWithinTheTolerance) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {0.9, 0, 0}, {1.8, 0, 0}, {5, 5, 5}, {9, 0, 0}, {0, 9, 0}};
  mesh.triangles = {{0, 4, 5}, {1, 4, 5}, {2, 4, 5}};
  const TriangleMesh welded = weld(mesh, 1);
  // 1 joins 0; 2 is within 1 of vertex 1, but that is gone. 3 is used by none.
  EXPECT_EQ(welded.vertices,
            (std::vector<Eigen::Vector3d>{{0, 0, 0}, {1.8, 0, 0}, {9, 0, 0}, {0, 9, 0}}));
  EXPECT_EQ(welded.triangles,
            (std::vector<std::array<std::uint32_t, 3>>{{0, 2, 3}, {0, 2, 3}, {1, 2, 3}}));
  EXPECT_EQ(weld(mesh, 0).vertices.size(), 5u);
}

}  // namespace
}  // namespace ist
