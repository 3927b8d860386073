#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>

#include <ist/mesh.h>
#include <ist/types.h>

#include "support/test_meshes.h"

namespace ist {
namespace {

using namespace testing;

TriangleMesh scaled_and_moved(TriangleMesh mesh, const double scale, const Eigen::Vector3d& by) {
  for (auto& v : mesh.vertices) v = v * scale + by;
  return mesh;
}

const Eigen::Vector3d kZero = Eigen::Vector3d::Zero();

std::string error_of(const TriangleMesh& mesh, const OpenMeshPolicy policy = {}) {
  try {
    close_mesh(mesh, "part", policy);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

bool has_note(const MeshReport& report, const std::string& words) {
  return std::any_of(report.notes.begin(), report.notes.end(), [&](const std::string& note) {
    return note.find(words) != std::string::npos;
  });
}

TEST(CloseMesh, CubeIsClosedAsItIs) {
  const ClosedMesh closed = close_mesh(cube_mesh(), "cube");
  EXPECT_TRUE(closed.report.closed);
  EXPECT_TRUE(closed.report.notes.empty());
  EXPECT_DOUBLE_EQ(closed.report.volume, 1);
  EXPECT_EQ(closed.mesh.triangles, cube_mesh().triangles);
  EXPECT_EQ(closed.report.bounds.min(), Eigen::Vector3d::Constant(-0.5));
}

TEST(CloseMesh, OpenCubeIsRefusedWithPlaceAndWayOut) {
  TriangleMesh open = box_mesh(kZero, Eigen::Vector3d::Ones());
  open.triangles.pop_back();  // {1, 7, 5}
  EXPECT_EQ(
      error_of(open),
      "part: 3 boundary edges, first at vertex 1 (1 0 0): the mesh is not closed. "
      "Close it, or have it repaired: --repair, in Python repair=True, in a manifest repair = "
      "true, in C repair = 1, in C++ OpenMeshPolicy::repair");
}

TEST(CloseMesh, UnweldedSoupIsWelded) {
  TriangleMesh soup;
  const TriangleMesh cube = cube_mesh();
  for (const auto& t : cube.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.vertices.size());
    for (const auto v : t) soup.vertices.push_back(cube.vertices[v]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  soup.vertices.emplace_back(std::numeric_limits<double>::quiet_NaN(), 0, 0);  // unreferenced
  const ClosedMesh closed = close_mesh(soup, "soup");
  EXPECT_EQ(closed.mesh.vertices.size(), 8u);
  EXPECT_DOUBLE_EQ(closed.report.volume, 1);
}

TEST(CloseMesh, NegativeZeroIsZero) {
  TriangleMesh cube = joined(box_mesh(kZero, Eigen::Vector3d::Ones()), {});
  cube.vertices.push_back({-0.0, -0.0, -0.0});
  cube.triangles[0][0] = 8;
  EXPECT_EQ(close_mesh(cube, "cube").report.vertices, 8u);
}

TEST(CloseMesh, WhatIsNoMeshIsRefused) {
  EXPECT_NE(error_of({}).find("no triangles"), std::string::npos);
  TriangleMesh mesh = cube_mesh();
  mesh.triangles[3][1] = 8;
  EXPECT_NE(error_of(mesh).find("triangle 3 refers to vertex 8 of 8"), std::string::npos);
  mesh = cube_mesh();
  mesh.vertices[5][2] = std::numeric_limits<double>::infinity();
  EXPECT_NE(error_of(mesh).find("vertex 5"), std::string::npos);
}

TEST(CloseMesh, FlatAndCollapsedAreRefused) {
  TriangleMesh flat = cube_mesh();
  for (auto& v : flat.vertices) v[2] = 0;
  EXPECT_NE(error_of(flat).find("flat"), std::string::npos);
  TriangleMesh lens = torus_mesh(2, 0.5, 8, 5);
  for (auto& v : lens.vertices) v[1] = 0;
  EXPECT_NE(error_of(lens, OpenMeshPolicy::repair).find("flat"), std::string::npos);
  // A sphere of size 1e-3 at 1e6, in float.
  TriangleMesh sphere = scaled_and_moved(icosphere_mesh(2), 1e-3, Eigen::Vector3d::Constant(1e6));
  EXPECT_EQ(error_of(sphere), "accepted");
  for (auto& v : sphere.vertices) v = v.cast<float>().cast<double>();
  EXPECT_NE(error_of(sphere).find("too few digits"), std::string::npos);
  // Not all of it gone, but most.
  TriangleMesh coarse = scaled_and_moved(icosphere_mesh(4), 0.2, Eigen::Vector3d::Constant(1e6));
  for (auto& v : coarse.vertices) v = v.cast<float>().cast<double>();
  EXPECT_NE(error_of(coarse).find("too few digits"), std::string::npos);
}

// Products of such coordinates overflow, and signs of infinite sums would be looked for for ever.
TEST(CloseMesh, WhatDoubleCannotCubeIsRefused) {
  const TriangleMesh mesh = joined(cube_mesh(), box_mesh(Eigen::Vector3d(0.5, 0, 0), {1, 1, 1}));
  EXPECT_EQ(error_of(mesh), "accepted");
  for (const double scale : {1e124, 1e300, 1e-100, 1e-300})
    EXPECT_NE(
        error_of(scaled_and_moved(mesh, scale, kZero)).find("is out of range. Scale or move it"),
        std::string::npos)
        << scale;
  EXPECT_NE(error_of(scaled_and_moved(mesh, 1e86, Eigen::Vector3d::Constant(1e101)))
                .find("is out of range. Scale or move it"),
            std::string::npos);
}

TEST(CloseMesh, ThinSolidsAreSolids) {
  for (const double thickness : {1e-3, 1e-6, 1e-9})
    EXPECT_NEAR(close_mesh(box_mesh(kZero, {1, 1, thickness}), "plate").report.volume, thickness,
                1e-12 * thickness);
}

TEST(CloseMesh, InsideOutIsTurned) {
  const ClosedMesh closed = close_mesh(inverted(cube_mesh()), "cube");
  EXPECT_EQ(closed.report.flipped_components, 1u);
  EXPECT_DOUBLE_EQ(closed.report.volume, 1);
  EXPECT_TRUE(has_note(closed.report, "1 shell turned"));
}

TEST(CloseMesh, CavitiesStay) {
  const TriangleMesh outer = scaled_and_moved(cube_mesh(), 4, kZero),
                     inner = scaled_and_moved(cube_mesh(), 2, kZero);
  const TriangleMesh core = cube_mesh();
  const ClosedMesh hollow = close_mesh(joined(outer, inverted(inner)), "hollow");
  EXPECT_EQ(hollow.report.cavities, 1u);
  EXPECT_EQ(hollow.report.flipped_components, 0u);
  EXPECT_DOUBLE_EQ(hollow.report.volume, 64 - 8);
  const ClosedMesh three = close_mesh(joined(joined(outer, inverted(inner)), core), "three");
  EXPECT_DOUBLE_EQ(three.report.volume, 64 - 8 + 1);
  // A core that faces inward within the cavity would be no solid: it is turned.
  const ClosedMesh turned =
      close_mesh(joined(joined(outer, inverted(inner)), inverted(core)), "three");
  EXPECT_DOUBLE_EQ(turned.report.volume, 64 - 8 + 1);
  EXPECT_EQ(turned.report.flipped_components, 1u);
  // Inside out as a whole: the cavity is still one.
  const ClosedMesh whole = close_mesh(inverted(joined(joined(outer, inverted(inner)), core)), "x");
  EXPECT_DOUBLE_EQ(whole.report.volume, 64 - 8 + 1);
  EXPECT_EQ(whole.report.cavities, 1u);
  EXPECT_EQ(whole.report.flipped_components, 3u);
}

TEST(CloseMesh, NestedSolidsAndOverlapsKeepTheirWindingNumber) {
  const ClosedMesh nested =
      close_mesh(joined(scaled_and_moved(cube_mesh(), 4, kZero), cube_mesh()), "nested");
  EXPECT_DOUBLE_EQ(nested.report.volume, 65);  // counted twice, as stated
  EXPECT_TRUE(has_note(nested.report, "winding number"));
  const ClosedMesh overlapping = close_mesh(overlapping_cubes_mesh(), "overlap");
  EXPECT_EQ(overlapping.report.flipped_components, 0u);
  EXPECT_GT(overlapping.report.self_intersections, 0u);
  EXPECT_TRUE(has_note(overlapping.report, "intersect"));
  EXPECT_TRUE(overlapping.report.meets_itself);
  EXPECT_EQ(overlapping.report.shells, 2u);
  // An inward shell that is only partly within another is no cavity.
  const TriangleMesh half_out =
      joined(cube_mesh(), inverted(box_mesh(kZero, Eigen::Vector3d::Constant(1.5))));
  EXPECT_EQ(close_mesh(half_out, "half out").report.flipped_components, 1u);
}

TEST(CloseMesh, CoincidentFacesAreTheirSignedSum) {
  // Twice the same shell: once.
  const ClosedMesh twice = close_mesh(joined(cube_mesh(), cube_mesh()), "twice");
  EXPECT_EQ(twice.report.coincident_triangles, 12u);
  EXPECT_DOUBLE_EQ(twice.report.volume, 1);
  // Face to face: the double wall is removed.
  const TriangleMesh block = joined(box_mesh(kZero, {1, 1, 1}),
                                    scaled_and_moved(box_mesh(kZero, {1, 1, 1}), 1, {1, 0, 0}));
  const ClosedMesh joined_block = close_mesh(block, "block");
  EXPECT_EQ(joined_block.report.coincident_triangles, 4u);
  EXPECT_EQ(joined_block.mesh.triangles.size(), 20u);
  EXPECT_GT(joined_block.report.self_intersections, 0u);  // the wall, as it came
  EXPECT_FALSE(joined_block.report.meets_itself);
  EXPECT_EQ(joined_block.report.shells, 1u);
  EXPECT_DOUBLE_EQ(joined_block.report.volume, 2);
  // A sum of zero (or two) that would open the mesh: one copy stays.
  for (const bool opposite : {false, true}) {
    TriangleMesh doubled = icosphere_mesh(2);
    for (std::size_t t = 0; t < 40; ++t) {
      auto copy = doubled.triangles[t];
      if (opposite) std::swap(copy[0], copy[1]);
      doubled.triangles.push_back(copy);
    }
    const ClosedMesh closed = close_mesh(doubled, "doubled");
    EXPECT_EQ(closed.report.coincident_triangles, 40u);
    EXPECT_EQ(closed.mesh.triangles.size(), 320u);
  }
}

TEST(CloseMesh, SharedWallOfTwoOverlappingShellsIsKeptTwice) {
  // Two boxes that share the face z = 0 with the same orientation: their sum is needed there.
  const TriangleMesh two = joined(box_mesh(kZero, {1, 1, 1}), box_mesh(kZero, {1, 1, 2}));
  const ClosedMesh closed = close_mesh(two, "two");
  EXPECT_EQ(closed.report.coincident_triangles, 0u);
  EXPECT_DOUBLE_EQ(closed.report.volume, 3);
}

TEST(CloseMesh, DegenerateTrianglesGoUnlessTheyCloseTheMesh) {
  TriangleMesh cube = box_mesh(kZero, {1, 1, 1});
  cube.vertices.push_back({0.5, 0, 0});
  cube.triangles.push_back({0, 8, 1});  // hangs on an edge
  cube.triangles.push_back({3, 3, 5});
  const ClosedMesh closed = close_mesh(cube, "cube");
  EXPECT_EQ(closed.report.degenerate_triangles, 2u);
  EXPECT_EQ(closed.mesh.triangles.size(), 12u);
  EXPECT_EQ(closed.mesh.vertices.size(), 8u);
  // The same corner split on one side only: the collinear triangle is the patch.
  TriangleMesh split = box_mesh(kZero, {1, 1, 1});
  split.vertices.push_back({0.5, 0, 0});
  for (auto& t : split.triangles)
    if (t == std::array<std::uint32_t, 3>{0, 1, 5}) t = {0, 8, 5};
  split.triangles.push_back({8, 1, 5});
  split.triangles.push_back({0, 1, 8});
  const ClosedMesh patched = close_mesh(split, "split");
  EXPECT_EQ(patched.report.degenerate_triangles, 1u);
  EXPECT_EQ(patched.mesh.triangles.size(), 14u);
  EXPECT_DOUBLE_EQ(patched.report.volume, 1);
}

TEST(CloseMesh, SharedEdgesAndCornersDoNotJoinShells) {
  const TriangleMesh edge =
      joined(box_mesh(kZero, {1, 1, 1}), inverted(box_mesh({1, 1, 0}, {2, 2, 1})));
  const ClosedMesh on_edge = close_mesh(edge, "edge");
  EXPECT_EQ(on_edge.report.nonmanifold_edges, 1u);
  EXPECT_EQ(on_edge.report.flipped_components, 1u);  // the second cube alone
  EXPECT_DOUBLE_EQ(on_edge.report.volume, 2);
  const TriangleMesh corner = joined(box_mesh(kZero, {1, 1, 1}), box_mesh({1, 1, 1}, {2, 2, 2}));
  EXPECT_DOUBLE_EQ(close_mesh(corner, "corner").report.volume, 2);
}

TEST(CloseMesh, NonOrientableIsRefusedEvenForRepair) {
  // The projective plane on six vertices: every edge has two faces, yet there is no outside.
  TriangleMesh plane;
  for (int i = 0; i < 6; ++i) plane.vertices.emplace_back(i, i * i % 5, i * i * i % 7);
  plane.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}, {0, 5, 1},
                     {1, 2, 4}, {2, 3, 5}, {3, 4, 1}, {4, 5, 2}, {5, 1, 3}};
  for (const auto policy : {OpenMeshPolicy::refuse, OpenMeshPolicy::repair})
    EXPECT_NE(error_of(plane, policy).find("not orientable"), std::string::npos)
        << error_of(plane, policy);
}

}  // namespace
}  // namespace ist
