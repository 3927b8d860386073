#include "mesh/connectivity/surface_reduction.h"

#include <gtest/gtest.h>

#include <vector>

#include "mesh/connectivity/edge_table.h"

namespace ist {
namespace {

/// A closed tetrahedron, and three more vertices on a line.
const std::vector<Eigen::Vector3d> kPoints = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1},
                                              {5, 0, 0}, {6, 0, 0}, {7, 0, 0}, {8, 0, 0}};
const std::vector<Triangle> kTetrahedron = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};

std::vector<std::uint32_t> dropped_of(std::vector<Triangle>& triangles) {
  return drop_degenerate(kPoints, triangles, EdgeTable(triangles));
}

TEST(SurfaceReduction, TrianglesOnALineThatHangLooseAreDropped) {
  std::vector<Triangle> triangles = kTetrahedron;
  triangles.push_back({4, 5, 6});
  EXPECT_EQ(dropped_of(triangles), std::vector<std::uint32_t>{4});
  EXPECT_EQ(triangles, kTetrahedron);
}

TEST(SurfaceReduction, SoAreThoseThatHangOnThem) {
  std::vector<Triangle> triangles = kTetrahedron;
  triangles.insert(triangles.begin() + 2, {4, 5, 6});
  triangles.push_back({5, 6, 7});  // its side with the other is even until that one goes
  triangles.push_back({0, 0, 1});
  EXPECT_EQ(dropped_of(triangles), (std::vector<std::uint32_t>{2, 5, 6}));
  EXPECT_EQ(triangles, kTetrahedron);
}

}  // namespace
}  // namespace ist
