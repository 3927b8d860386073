#include "library/settings/bake_settings.h"

#include <gtest/gtest.h>

#include <cmath>

#include <ist/types.h>

#include "library/input_mesh.h"
#include "library/settings/numbers.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

TEST(Numbers, Bytes) {
  EXPECT_EQ(parse_bytes("0"), 0u);
  EXPECT_EQ(parse_bytes("4096"), 4096u);
  EXPECT_EQ(parse_bytes("3K"), 3072u);
  EXPECT_EQ(parse_bytes("10G"), std::uint64_t{10} << 30);
  EXPECT_EQ(parse_bytes("16777215T"), std::uint64_t{16777215} << 40);
  for (const char* text :
       {"", "K", "1.5G", "-1", "10g", "10GB", "16777216T", "99999999999999999999"})
    EXPECT_EQ(parse_bytes(text), std::nullopt) << text;
}

/// A mirror would turn the solid inside out; the rotation is the quarter turn that people know.
TEST(Placing, TurnsWithoutMirroring) {
  for (const char from : {'X', 'Y', 'Z'})
    for (const char to : {'X', 'Y', 'Z'}) {
      TriangleMesh mesh;
      mesh.vertices = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
      place(mesh, {.repair = false, .scale = {2, 2, 2}, .up_axis = from, .world_up = to});
      Eigen::Matrix3d turned;
      for (int k = 0; k < 3; ++k) turned.col(k) = mesh.vertices[static_cast<std::size_t>(k)];
      EXPECT_EQ(turned.determinant(), 8);
      EXPECT_EQ(turned(to - 'X', from - 'X'), 2);
    }
  TriangleMesh mesh;
  mesh.vertices = {{1, 2, 3}};
  place(mesh, {.repair = false, .scale = {1, 10, -1}, .up_axis = 'Y', .world_up = 'Z'});
  EXPECT_EQ(mesh.vertices[0], Eigen::Vector3d(1, 3, 20));  // scaled along the file's axes first
}

/// A mirrored solid is no hole: its volume stays above 0.
TEST(Placing, ScalesEachAxisAndMirrors) {
  for (const double x : {1., -2.})
    for (const double y : {1., -0.5})
      for (const double z : {3., -3.}) {
        TriangleMesh mesh = testing::box_mesh({1, 2, 3}, {2, 4, 6});
        scale_mesh(mesh, {x, y, z});
        double volume = 0;
        for (const auto& [a, b, c] : mesh.triangles)
          volume += mesh.vertices[a].dot(mesh.vertices[b].cross(mesh.vertices[c])) / 6;
        EXPECT_EQ(volume, 6 * std::abs(x * y * z));
        EXPECT_EQ(mesh.vertices[7], Eigen::Vector3d(2 * x, 4 * y, 6 * z));
      }
  TriangleMesh mesh = testing::cube_mesh();
  for (const double odd : {0., -0., std::nan(""), HUGE_VAL})
    EXPECT_THROW(scale_mesh(mesh, {1, odd, 1}), Error) << odd;
}

TEST(Settings, TakeOneFactorOrThree) {
  using Eigen::Vector3d;
  EXPECT_EQ(parse_factors("1e-3"), Vector3d::Constant(1e-3).eval());
  EXPECT_EQ(parse_factors("1,-2.5,3"), Vector3d(1, -2.5, 3));
  for (const char* text :
       {"", ",", "1,2", "1,2,3,", "1,2,3,4", "1,,3", "0", "1,0,1", "nan", "1,inf,1", "1, 2, 3"})
    EXPECT_EQ(parse_factors(text), std::nullopt) << text;
}

TEST(Settings, AreDescribedWithAllDigits) {
  BakeSettings a, b;
  EXPECT_EQ(describe_exactly(a), describe_exactly(b));
  b.packing.min_radius = 0x1p-60;
  EXPECT_NE(describe_exactly(a), describe_exactly(b));
}

}  // namespace
}  // namespace ist
