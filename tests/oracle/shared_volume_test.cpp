#include <gtest/gtest.h>

#include <numbers>

#include "bake/predict/shared_volume.h"
#include "mesh/mesh_solid.h"
#include "support/oracle_rows.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

// Against exact boolean volumes: the estimated error is one, and what was asked for is met.
TEST(SharedVolume, IsThatOfTheExactBooleans) {
  IST_NEEDS_SHARED("oracle/poses/poses_eledino.csv");
  const auto solid = [](const char* name) {
    return MeshSolid(close_mesh(load_mesh(testing::oracle_mesh_path(name)), name));
  };
  const MeshSolid elephant = solid("elephant"), dino = solid("dino");
  constexpr double kAsked = 1e-3;
  int rows = 0, far_out = 0;
  for (const testing::OracleRow& row : testing::read_oracle_rows("eledino")) {
    if (row.id % 4 != 0) continue;
    const bool feels_force = row.translation_gradient.norm() > 0;
    const Eigen::Vector3d along = feels_force ? row.translation_gradient : Eigen::Vector3d::UnitX();
    const SharedVolume found = shared_volume(elephant, dino, row.pose, row.scale_b, along, kAsked);
    if (row.volume == 0) {
      EXPECT_EQ(found.volume, 0) << row.id;
      continue;
    }
    ++rows;
    EXPECT_LE(found.error, kAsked * found.volume) << row.id;
    EXPECT_NEAR(found.volume, row.volume, kAsked * row.volume) << row.id;
    if (std::abs(found.volume - row.volume) > found.error) ++far_out;
  }
  EXPECT_GE(rows, 30);
  EXPECT_LE(far_out, rows / 10);
}

TEST(SharedVolume, OfCubesAtAnyScaleAndPlace) {
  const MeshSolid cube(testing::closed(testing::cube_mesh(), "cube"));  // [0, 1]³
  const Eigen::AlignedBox3d box = cube.bounds();
  const Eigen::Vector3d size = box.sizes();
  const double s = 0.25;
  // Half of the small cube lies inside.
  Pose pose;
  const Eigen::Vector3d at = box.center() - s * box.center() + Eigen::Vector3d(size.x() / 2, 0, 0);
  for (int k = 0; k < 3; ++k) pose.t[k] = at[k];
  const double expected = 0.5 * s * s * s * size.prod();
  for (const Eigen::Vector3d& along :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(1, 2, -3)}) {
    const SharedVolume found = shared_volume(cube, cube, pose, s, along, 1e-3);
    EXPECT_NEAR(found.volume, expected, 2e-3 * expected);
  }
  // One in the other: all of it.
  const Eigen::Vector3d middle = (1 - s) * box.center();
  for (int k = 0; k < 3; ++k) pose.t[k] = middle[k];
  EXPECT_NEAR(shared_volume(cube, cube, pose, s, {1, 1, 0}, 1e-3).volume, 2 * expected,
              4e-3 * expected);
}

}  // namespace
}  // namespace ist
