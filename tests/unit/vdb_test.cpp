#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <cstdio>
#include <fstream>
#include <numbers>
#include <string>

#include <ist/asset_layout.h>
#include <ist/bake.h>
#include <ist/solid.h>
#include <ist/types.h>

namespace {

using openvdb::FloatGrid;

class Vdb : public testing::Test {
 protected:
  Vdb() { openvdb::initialize(); }
  ~Vdb() override { std::remove(path_.c_str()); }

  const std::string& written(const openvdb::GridPtrVec& grids) {
    openvdb::io::File(path_).write(grids);
    return path_;
  }
  void expect_refused(const std::string& why) {
    try {
      ist::load_vdb(path_);
      ADD_FAILURE() << "accepted: " << why;
    } catch (const ist::Error& error) {
      EXPECT_EQ(std::string(error.what()).find(path_ + ": "), 0u) << error.what();
      EXPECT_NE(std::string(error.what()).find(why), std::string::npos) << error.what();
    }
  }

  const std::string path_ = testing::TempDir() + "ist_" +
                            testing::UnitTest::GetInstance()->current_test_info()->name() + ".vdb";
};

FloatGrid::Ptr ball(float radius = 2, float voxel = 0.1f) {
  return openvdb::tools::createLevelSetSphere<FloatGrid>(radius, openvdb::Vec3f(1, 2, 3), voxel);
}

TEST_F(Vdb, ALevelSetIsBakedAndProven) {
  const ist::LevelSetMesh made = ist::load_vdb(written({ball()}));
  EXPECT_LE(made.error, 0.05);
  for (const Eigen::Vector3d& v : made.mesh.mesh.vertices)
    ASSERT_NEAR((v - Eigen::Vector3d(1, 2, 3)).norm(), 2, 0.02);
  const auto solid = ist::load_vdb_solid(path_);
  EXPECT_NEAR(solid->volume() / (32 * std::numbers::pi / 3), 1, 0.005);
  EXPECT_NEAR(solid->signed_distance({1, 2, 3}), -2, 0.01);  // far deeper than the band
  ist::PackingSettings settings;
  settings.max_spheres = 200;
  const ist::Asset asset = ist::bake(*solid, settings);
  EXPECT_GT(asset.view().header().coverage, 0.9);
  const ist::ClosedMesh mesh = ist::close_mesh(ist::load_mesh(path_), path_);
  for (const ist::Invariant& one : ist::check(asset, mesh))
    EXPECT_EQ(one.violations, 0u) << one.name;
}

TEST_F(Vdb, LinearTransformsPlaceIt) {
  const FloatGrid::Ptr grid = ball(20, 1);
  const auto turn = openvdb::math::Transform::createLinearTransform(1);
  turn->postRotate(0.7, openvdb::math::Y_AXIS);
  turn->postScale(openvdb::Vec3d(-0.1, 0.1, 0.2));
  grid->setTransform(turn);
  const ist::LevelSetMesh made = ist::load_vdb(written({grid}));
  EXPECT_NEAR(made.mesh.report.volume, 4 * std::numbers::pi / 3 * 8000 * 0.002, 0.3);
  const openvdb::Vec3d centre = turn->indexToWorld(openvdb::Vec3d(1, 2, 3));
  const Eigen::Vector3d middle = made.mesh.report.bounds.center();
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(middle[k], centre[k], 0.01);
}

TEST_F(Vdb, RefusesWhatIsNoLevelSet) {
  const FloatGrid::Ptr fog = ball();
  fog->setName("density");
  fog->setGridClass(openvdb::GRID_FOG_VOLUME);
  written({fog});
  expect_refused("'density' is of class 'fog volume', not a level set");
  const FloatGrid::Ptr empty = FloatGrid::create(0.3f);
  empty->setGridClass(openvdb::GRID_LEVEL_SET);
  written({empty});
  expect_refused("is empty");
  const FloatGrid::Ptr first = ball(), second = ball();
  first->setName("left");
  second->setName("right");
  written({first, second});
  expect_refused("contains 2 grids ('left', 'right')");
  written({openvdb::Vec3SGrid::create()});
  expect_refused("not float");
  written({});
  expect_refused("no grid");
  const FloatGrid::Ptr inverted = FloatGrid::create(-0.3f);
  inverted->setGridClass(openvdb::GRID_LEVEL_SET);
  inverted->tree().setValue({1, 2, 3}, 0.1f);
  written({inverted});
  expect_refused("touches the grid's border");
  std::ofstream(path_) << "no vdb at all";
  expect_refused("OpenVDB cannot read it");
  std::remove(path_.c_str());
  expect_refused("no such file");
  EXPECT_THROW(ist::load_mesh(path_), ist::Error);
}

}  // namespace
