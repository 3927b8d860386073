#include <gtest/gtest.h>

#include <random>

#include "mesh/closest_point.h"
#include "mesh/mesh_solid.h"
#include "support/test_meshes.h"

namespace {

using namespace ist::testing;
using ist::MeshSolid;

TEST(MeshSolid, VolumesOfSmallMeshes) {
  EXPECT_NEAR(MeshSolid(closed(cube_mesh(), "cube")).volume(), 1, 1e-15);
  const MeshSolid torus(closed(torus_mesh(2, 0.5, 64, 32), "torus"));
  EXPECT_NEAR(torus.volume(), 2 * 9.8696044010893586 * 2 * 0.25, 0.1);
  EXPECT_LT(torus.volume_error(), 1e-12 * torus.volume());
}

TEST(MeshSolid, SignedDistanceOfTheCube) {
  const MeshSolid cube(closed(cube_mesh(), "cube"));
  EXPECT_DOUBLE_EQ(cube.signed_distance({0, 0, 0}), 0.5);
  EXPECT_DOUBLE_EQ(cube.signed_distance({0.25, 0.1, 0}), 0.25);
  EXPECT_DOUBLE_EQ(cube.signed_distance({0, 1.5, 0}), -1);
  EXPECT_DOUBLE_EQ(cube.signed_distance({0.5, 0.5, 0.5}), 0);
}

TEST(MeshSolid, ClosestPointIsTheMinimumOverAllTriangles) {
  const MeshSolid solid(closed(torus_mesh(2, 0.5, 40, 20), "torus"));
  const ist::MeshView& mesh = solid.view();
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> coordinate(-1.2, 1.2);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d p(coordinate(random), coordinate(random), coordinate(random));
    double best = 1e300;
    std::uint32_t triangle = 0;
    for (std::uint32_t t = 0; t < mesh.triangle_count; ++t) {
      const auto corner = [&](int k) {
        return mesh.vertices_exact + 3 * mesh.triangles[3 * t + k];
      };
      const auto frame = ist::make_triangle_frame(corner(0), corner(1), corner(2));
      const double d2 = ist::closest_in_frame(frame, p.data()).distance2;
      if (d2 < best) {
        best = d2;
        triangle = t;
      }
    }
    const ist::ClosestPoint closest = solid.closest_point(p);
    EXPECT_EQ(closest.distance, std::sqrt(best));
    EXPECT_EQ(closest.triangle, triangle);
    EXPECT_NEAR((closest.point - p).norm(), closest.distance, 1e-15);
    EXPECT_NEAR(
        std::sqrt(ist::nearest_triangle(mesh, std::data({float(p.x()), float(p.y()), float(p.z())}))
                      .distance2),
        closest.distance, 1e-6);
  }
}

TEST(MeshSolid, WindingCountsShells) {
  const MeshSolid solid(closed(overlapping_cubes_mesh(), "cubes"));
  const auto winding = [&](double x, double y, double z) {
    return solid.winding_number(solid.frame().to_unit({x, y, z}));
  };
  EXPECT_EQ(winding(0.25, 0.25, 0.25), 2);
  EXPECT_EQ(winding(-0.25, -0.25, -0.25), 1);
  EXPECT_EQ(winding(-0.25, 0, 0), 1);  // the ray meets edges, corners and diagonals
  EXPECT_EQ(winding(0.75, 0.5, 0.5), 1);
  EXPECT_EQ(winding(2, 0.5, 0.5), 0);
  EXPECT_EQ(winding(-2, 0.5, 0.5), 0);
  EXPECT_EQ(winding(-2, 0, 0), 0);
}

}  // namespace
