#include "library/settings/bake_settings.h"

#include <gtest/gtest.h>

#include "library/input_mesh.h"
#include "library/settings/numbers.h"

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
      place(mesh, {.repair = false, .scale = 2, .up_axis = from, .world_up = to});
      Eigen::Matrix3d turned;
      for (int k = 0; k < 3; ++k) turned.col(k) = mesh.vertices[static_cast<std::size_t>(k)];
      EXPECT_EQ(turned.determinant(), 8);
      EXPECT_EQ(turned(to - 'X', from - 'X'), 2);
    }
  TriangleMesh mesh;
  mesh.vertices = {{1, 2, 3}};
  place(mesh, {.repair = false, .scale = 1, .up_axis = 'Y', .world_up = 'Z'});
  EXPECT_EQ(mesh.vertices[0], Eigen::Vector3d(1, -3, 2));
}

TEST(Settings, AreDescribedWithAllDigits) {
  BakeSettings a, b;
  EXPECT_EQ(describe_exactly(a), describe_exactly(b));
  b.packing.min_radius = 0x1p-60;
  EXPECT_NE(describe_exactly(a), describe_exactly(b));
}

}  // namespace
}  // namespace ist
