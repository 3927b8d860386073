#include <gtest/gtest.h>

#include <ist/error.h>
#include <ist/mesh.h>

namespace ist {
namespace {

TriangleMesh cube() {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.vertices.emplace_back(i & 1, (i >> 1) & 1, (i >> 2) & 1);
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

TEST(CloseMesh, CubeIsClosedAsItIs) {
  const ClosedMesh closed = close_mesh(cube(), "cube");
  EXPECT_TRUE(closed.report.closed);
  EXPECT_DOUBLE_EQ(closed.report.volume, 1);
  EXPECT_EQ(closed.mesh.triangles, cube().triangles);
}

TEST(CloseMesh, OpenCubeIsRefusedWithPlaceAndWayOut) {
  TriangleMesh open = cube();
  open.triangles.pop_back();
  try {
    close_mesh(open, "cube");
    FAIL() << "accepted an open mesh";
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("cube: 3 boundary edges, first at vertex 3 (1 1 0)"), std::string::npos)
        << message;
    EXPECT_NE(message.find("--repair"), std::string::npos) << message;
  }
}

}  // namespace
}  // namespace ist
