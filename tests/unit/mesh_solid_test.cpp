#include "mesh/mesh_solid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <ist/types.h>

#include "mesh/mesh_moments.h"
#include "support/float_traps.h"
#include "support/shared_data.h"
#include "support/test_meshes.h"

namespace {

using namespace ist::testing;
using Eigen::Vector3d;
using ist::MeshSolid;

double volume_of(const ist::TriangleMesh& mesh) { return MeshSolid(closed(mesh, "mesh")).volume(); }

TEST(MeshSolid, SignedDistanceOfTheCube) {
  const MeshSolid cube(closed(cube_mesh(), "cube"));
  EXPECT_DOUBLE_EQ(cube.signed_distance({0, 0, 0}), -0.5);
  EXPECT_DOUBLE_EQ(cube.signed_distance({0.25, 0.1, 0}), -0.25);
  EXPECT_DOUBLE_EQ(cube.signed_distance({0, 1.5, 0}), 1);
  EXPECT_DOUBLE_EQ(cube.signed_distance({0.5, 0.5, 0.5}), 0);
}

TEST(MeshSolid, SignedDistanceIsLipschitz) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> coordinate(-2.8, 2.8);
  const auto point = [&] {
    return Vector3d(coordinate(random), coordinate(random), coordinate(random));
  };
  for (const auto& mesh : {torus_mesh(2, 0.5, 40, 20), overlapping_cubes_mesh()}) {
    const MeshSolid solid(closed(mesh, "mesh"));
    for (int i = 0; i < 20'000; ++i) {
      const Vector3d p = point();
      const Vector3d q = (i & 1) != 0 ? point() : Vector3d(p + 0.01 * point());
      ASSERT_LE(std::abs(solid.signed_distance(p) - solid.signed_distance(q)),
                (p - q).norm() + 1e-14);
    }
  }
}

TEST(MeshSolid, VolumesInClosedForm) {
  EXPECT_NEAR(volume_of(cube_mesh()), 1, 1e-15);
  EXPECT_NEAR(volume_of(box_mesh({5, -1, 0}, {6, 1, 1e-6})), 2e-6, 1e-21);  // plate
  EXPECT_NEAR(volume_of(box_mesh({0, 0, 0}, {1, 1e-6, 1e-6})), 1e-12, 1e-27);
  const ist::TriangleMesh hollow =
      joined(cube_mesh(), inverted(box_mesh(Vector3d::Constant(-0.3), Vector3d::Constant(0.3))));
  EXPECT_NEAR(volume_of(hollow), 1 - 0.216, 1e-15);
  const ist::TriangleMesh nested =
      joined(cube_mesh(), box_mesh(Vector3d::Constant(-0.3), Vector3d::Constant(0.3)));
  EXPECT_NEAR(volume_of(nested), 1, 1e-6);  // the inner shell adds nothing
}

/// Overlaps count once, within the stated error, and that is small.
TEST(MeshSolid, OverlappingShellsCountOnce) {
  const double third = 1.0 / 3;
  struct Case {
    ist::TriangleMesh mesh;
    double volume;
  };
  const Case cases[] = {
      {overlapping_cubes_mesh(), 2 - 0.125},
      {joined(overlapping_cubes_mesh(), cube_mesh()), 2 - 0.125},
      {joined(cube_mesh(), box_mesh({0.1, -0.7, -0.2}, {0.1 + third, 0.7, 0.3})),
       1 + third * 0.4 * 0.5},
      // Less one box than another: negative windings are outside.
      {joined(cube_mesh(), inverted(box_mesh({0.1, -0.7, -0.2}, {0.1 + third, 0.7, 0.3}))),
       1 - third * 0.5},
      {joined(cube_mesh(), box_mesh({5, 5, 5}, {6, 6, 6})), 2}};
  for (const Case& c : cases) {
    const MeshSolid solid(closed(c.mesh, "shells"));
    EXPECT_LE(std::abs(solid.volume() - c.volume), solid.volume_error());
    EXPECT_LT(std::abs(solid.volume() - c.volume), 1e-6 * c.volume);
    EXPECT_LT(solid.volume_error(), 5e-4 * c.volume);
  }
}

/// Two overlapping icospheres against the lens of the balls they approach.
TEST(MeshSolid, OverlapOfRoundShells) {
  ist::TriangleMesh other = icosphere_mesh(5);
  for (auto& v : other.vertices) v += Vector3d(0.6, 0.8, 0);
  const double single = volume_of(icosphere_mesh(5));
  const double lens = 3.14159265358979323846 * 5 / 12;
  EXPECT_NEAR(volume_of(joined(icosphere_mesh(5), other)), 2 * single - lens, 2e-3 * lens);
}

TEST(MeshSolid, OneSimpleShellNeedsNoIntegration) {
  ist::ClosedMesh torus = closed(torus_mesh(2, 0.5, 64, 32), "torus");
  const MeshSolid integrated(torus);
  torus.report.meets_itself = false;
  torus.report.shells = 1;
  const MeshSolid simple(torus);
  EXPECT_LT(simple.volume_error(), 1e-12 * simple.volume());
  EXPECT_NEAR(integrated.volume(), simple.volume(), 1e-12 * simple.volume());
}

/// A power of two changes no bit in the unit frame; any other scale, and an offset of 1e7 sizes,
/// only what their own rounding does (docs/design.md 3.1).
TEST(MeshSolid, ScaleAndOffsetDoNotMatter) {
  const ist::TriangleMesh torus = torus_mesh(2, 0.5, 40, 20);
  const MeshSolid plain(closed(torus, "plain"));
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> coordinate(-2.5, 2.5);
  for (const double size : {1e-9, 0x1p-20, 1.0, 1e9}) {
    for (const double offset : {0.0, 1e7}) {
      const Vector3d shift = offset * size * Vector3d(1, -0.5, 0.25);
      ist::TriangleMesh moved = torus;
      for (auto& v : moved.vertices) v = size * v + shift;
      const MeshSolid solid(closed(moved, "moved"));
      const double accuracy = offset == 0 ? 1e-13 : 1e-7;
      EXPECT_NEAR(solid.unit_volume() * std::pow(solid.frame().scale() / size, 3), plain.volume(),
                  accuracy * plain.volume());
      for (int i = 0; i < 300; ++i) {
        const Vector3d p(coordinate(random), coordinate(random), coordinate(random));
        const double expected = plain.signed_distance(p);
        if (std::abs(expected) < 1e-6) continue;
        EXPECT_NEAR(solid.signed_distance(size * p + shift) / size, expected, 10 * accuracy);
      }
      if (offset == 0 && size == 0x1p-20) {
        EXPECT_EQ(solid.unit_volume(), plain.unit_volume());
      }
    }
  }
}

TEST(MeshSolid, HashTellsMeshesApart) {
  const std::uint64_t hash = MeshSolid(closed(cube_mesh(), "a")).hash();
  EXPECT_EQ(MeshSolid(closed(cube_mesh(), "another name")).hash(), hash);
  ist::TriangleMesh mesh = cube_mesh();
  mesh.vertices[3].x() = std::nextafter(mesh.vertices[3].x(), 1);
  EXPECT_NE(MeshSolid(closed(mesh, "a")).hash(), hash);
  mesh = cube_mesh();
  std::swap(mesh.triangles[0], mesh.triangles[1]);
  EXPECT_NE(MeshSolid(closed(mesh, "a")).hash(), hash);
  mesh = cube_mesh();
  for (auto& v : mesh.vertices) v.z() += 1;  // the frame moves along
  EXPECT_NE(MeshSolid(closed(mesh, "a")).hash(), hash);
}

TEST(MeshSolid, UnreferencedVerticesAreIgnored) {
  const NoFloatTraps with_nan;
  ist::TriangleMesh mesh = cube_mesh();
  mesh.vertices.emplace_back(std::nan(""), 1e300, 0);
  const MeshSolid solid(closed(mesh, "stray"));
  EXPECT_EQ(solid.view().vertex_count, 8u);
  EXPECT_EQ(solid.bounds().max().x(), 0.5);
  EXPECT_EQ(solid.hash(), MeshSolid(closed(cube_mesh(), "cube")).hash());
}

TEST(MeshSolid, RefusesWhatIsNoMesh) {
  EXPECT_THROW(MeshSolid(closed(ist::TriangleMesh(), "empty")), ist::Error);
  ist::TriangleMesh mesh = cube_mesh();
  mesh.triangles[5][1] = 8;
  EXPECT_THROW(MeshSolid(closed(mesh, "past the end")), ist::Error);
}

/// Real meshes that do not meet themselves, against volumes computed elsewhere.
TEST(MeshSolid, VolumesOfRealMeshes) {
  IST_NEEDS_SHARED("meshes/dev/MESHES.csv");
  struct Row {
    std::string file;
    double volume;
  };
  const Row rows[] = {
      {"spot.obj", 0.718259},     {"torus.off", 1.21878},          {"bunny_60k.ply", 0.745451},
      {"sword.ply", 0.000210359}, {"tray_perforated.stl", 347866}, {"adis16480.stl", 2.81925e-05},
      {"mug.ply", 133.298},       {"bolt_gen.ply", 9513.61},       {"nut_gen.ply", 3372.2}};
  for (const Row& row : rows) {
    const std::string path = shared_path("meshes/dev/" + row.file).string();
    const MeshSolid solid(ist::close_mesh(ist::load_mesh(path), row.file));
    EXPECT_NEAR(solid.volume(), row.volume, 5e-6 * row.volume) << row.file;
    EXPECT_LT(solid.volume_error(), 1e-9 * row.volume) << row.file;
    // Integration finds no excess either.
    const auto hierarchy = [&]() -> const ist::MeshView& { return solid.view(); };
    EXPECT_NEAR(ist::winding_set_moments(solid.arrays(), false, hierarchy).volume,
                solid.unit_volume(), 1e-12 * solid.unit_volume())
        << row.file;
  }
}

}  // namespace
