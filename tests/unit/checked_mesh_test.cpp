#include "bake/check/checked_mesh.h"

#include <gtest/gtest.h>

#include <random>

#include "mesh/mesh_solid.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

// Two independent implementations of the same answer: that of packing and that of check.
TEST(CheckedMesh, AgreesWithTheSolid) {
  const TriangleMesh meshes[] = {
      testing::cube_mesh(), testing::torus_mesh(1.0, 0.4, 40, 20), testing::icosphere_mesh(3),
      testing::overlapping_cubes_mesh(),
      testing::joined(testing::icosphere_mesh(2),
                      testing::inverted(testing::box_mesh({-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3})))};
  std::mt19937 bits(1);
  for (const TriangleMesh& mesh : meshes) {
    const ClosedMesh closed = testing::closed(mesh, "mesh");
    const MeshSolid solid(closed);
    const CheckedMesh surface(closed, solid.frame());
    // Random points, and points of a lattice, which share planes with edges and corners.
    for (int i = 0; i < 4000; ++i) {
      const auto coordinate = [&] {
        return i % 2 == 0 ? static_cast<double>(bits()) / 2147483648.0 - 1
                          : static_cast<double>(bits() % 33) / 16 - 1;
      };
      const Eigen::Vector3d p(coordinate(), coordinate(), coordinate());
      const double distance = solid.closest_point(p).distance;
      EXPECT_NEAR(surface.distance(p, 10), distance, 1e-14);
      EXPECT_GE(surface.distance(p, 0.1), std::min(0.1, distance - 1e-14));
      if (distance > 1e-9) {
        EXPECT_EQ(surface.winding(p), solid.winding_number(p)) << p.transpose();
      }
    }
  }
}

}  // namespace
}  // namespace ist
