#include <gtest/gtest.h>

#include <random>

#include "packing/banded/mesh_surface.h"

namespace ist::packing {
namespace {

/// Two boxes that share a corner region: convex edges, one concave seam.
ClosedMesh l_shape() {
  ClosedMesh mesh;
  mesh.name = "L";
  const double outline[6][2] = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
  for (int z = 0; z < 2; ++z)
    for (const auto& p : outline) mesh.mesh.vertices.emplace_back(p[0], p[1], 0.1 * z);
  const std::array<std::uint32_t, 3> cap[4] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}};
  for (const auto& t : cap) {
    mesh.mesh.triangles.push_back({t[0], t[2], t[1]});
    mesh.mesh.triangles.push_back({t[0] + 6, t[1] + 6, t[2] + 6});
  }
  for (std::uint32_t i = 0; i < 6; ++i) {
    const std::uint32_t j = (i + 1) % 6;
    mesh.mesh.triangles.push_back({i, j, j + 6});
    mesh.mesh.triangles.push_back({i, j + 6, i + 6});
  }
  return mesh;
}

TEST(ConvexPlanes, NoClearanceInTheCellExceedsThem) {
  const MeshSolid solid(l_shape());
  const MeshSurface surface(solid);
  const SerialTeam team;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(-1, 1);
  int answered = 0, refused = 0;
  for (int round = 0; round < 3000; ++round) {
    const Float3 x{unit(random), unit(random), 0.1f * unit(random)};
    const float half = 0.002f + 0.1f * std::fabs(unit(random));
    SampleMemory planes;
    std::uint32_t triangles[32];
    const int count = surface.convex_planes(team, x, half * 1.7320510f, surface.inside(team, x),
                                            triangles, 32, &planes, 0);
    (count > 0 ? answered : refused)++;
    for (int i = 0; i < 40 && count > 0; ++i) {
      const Float3 y = half * Float3{unit(random), unit(random), unit(random)};
      const double clearance = surface.clearance(team, x + y, 10);
      if (clearance < 0) continue;
      for (int k = 0; k < count; ++k)
        ASSERT_LE(clearance,
                  planes.distance[k] + dot(get(SerialTeam{}, &planes, k).gradient, y) + 1e-6)
            << "round " << round;
    }
  }
  EXPECT_GT(answered, 500);
  EXPECT_GT(refused, 50);  // about the concave seam
}

}  // namespace
}  // namespace ist::packing
