#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/types.h>
#include <oneapi/tbb/global_control.h>

#include <set>

#include "mesh/samples/samples.h"
#include "support/certified_packing.h"
#include "support/same_packing.h"
#include "support/shared_data.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

using testing::expect_certified;
using testing::same_bytes;

/// At most 32 cells on a side, whatever the mode.
PackingSettings small(GridMode mode, std::size_t spheres) {
  PackingSettings settings;
  settings.device = Device::cpu;
  settings.grid = mode;
  settings.max_spheres = spheres;
  if (mode == GridMode::uniform) {
    settings.grids.resolution = 32;
  } else if (mode != GridMode::banded) {
    settings.grids.start = 4;
    settings.grids.refinements = 3;
    settings.grids.resolution = mode == GridMode::implicit_refinement ? 32 : 8;
  }
  return settings;
}

constexpr GridMode kModes[] = {GridMode::banded, GridMode::uniform, GridMode::explicit_refinement,
                               GridMode::implicit_refinement, GridMode::hybrid};

void expect_sound(const ClosedMesh& mesh) {
  const oneapi::tbb::global_control allow_two(oneapi::tbb::global_control::max_allowed_parallelism,
                                              2);
  const MeshSolid solid(mesh);
  std::set<float> second_radii;
  for (const GridMode mode : kModes) {
    SCOPED_TRACE(mesh.name + ", mode " + std::to_string(static_cast<int>(mode)));
    PackingSettings settings = small(mode, 500);
    settings.threads = 1;
    const SpherePacking packing = pack(solid, settings);
    EXPECT_EQ(packing.spheres.size(), 500u);
    EXPECT_EQ(packing.stop, StopReason::sphere_count);
    EXPECT_GT(packing.coverage, 0.5);
    expect_certified(packing, solid);
    settings.threads = 2;
    EXPECT_TRUE(same_bytes(packing, pack(solid, settings)));
    if (mode == GridMode::banded) continue;  // its seed breaks ties only
    settings.seed = 1;
    EXPECT_FALSE(same_bytes(packing, pack(solid, settings)));
  }
}

TEST(GridPacking, EveryModePacksACube) {
  expect_sound(testing::closed(testing::cube_mesh(), "cube"));
}

TEST(GridPacking, EveryModePacksABall) {
  expect_sound(testing::closed(testing::icosphere_mesh(2), "icosphere"));
}

TEST(GridPacking, EveryModePacksTheDino) {
  IST_NEEDS_SHARED("oracle/meshes/dino.off");
  expect_sound(
      close_mesh(load_mesh(testing::shared_path("oracle/meshes/dino.off").string()), "dino"));
}

TEST(GridPacking, ShellsThatOverlapOrNestAreOneSolid) {
  expect_sound(testing::closed(testing::overlapping_cubes_mesh(), "overlapping cubes"));
  const TriangleMesh hollow =
      testing::joined(testing::icosphere_mesh(2),
                      testing::inverted(testing::box_mesh(Eigen::Vector3d::Constant(-0.3),
                                                          Eigen::Vector3d::Constant(0.3))));
  expect_sound(testing::closed(hollow, "hollow ball"));
}

/// The distance grid only serves speed: the packing depends on the prototype grid alone.
TEST(GridPacking, TheDistanceGridDoesNotChangeABit) {
  const MeshSolid solid(close_mesh(make_sample("bolt"), "bolt"));
  const SpherePacking expected = pack(solid, small(GridMode::explicit_refinement, 400));
  EXPECT_TRUE(same_bytes(expected, pack(solid, small(GridMode::hybrid, 400))));
  for (const unsigned resolution : {4u, 16u, 64u}) {
    PackingSettings settings = small(GridMode::implicit_refinement, 400);
    settings.grids.resolution = resolution;
    EXPECT_TRUE(same_bytes(expected, pack(solid, settings))) << resolution << " cells";
  }
}

TEST(GridPacking, OtherLimitsStopIt) {
  const MeshSolid solid(testing::closed(testing::cube_mesh(), "cube"));
  PackingSettings settings = small(GridMode::hybrid, 0);
  settings.target_coverage = 0.6;
  SpherePacking packing = pack(solid, settings);
  EXPECT_EQ(packing.stop, StopReason::coverage);
  EXPECT_GE(packing.coverage, 0.6);
  const std::size_t spheres = packing.spheres.size();
  settings.max_spheres = spheres - 1;
  EXPECT_LT(pack(solid, settings).coverage, 0.6);

  settings = small(GridMode::hybrid, 0);
  settings.min_radius = 0.08;
  packing = pack(solid, settings);
  EXPECT_EQ(packing.stop, StopReason::min_radius);
  EXPECT_GT(packing.spheres.size(), 8u);
  for (const Sphere& s : packing.spheres) EXPECT_GE(double{s.r} * packing.frame.scale(), 0.08);

  settings.min_radius = 0;
  settings.time_limit = 1e-3;
  packing = pack(solid, settings);
  EXPECT_EQ(packing.stop, StopReason::time_limit);
  expect_certified(packing, solid);
}

TEST(GridPacking, ACancelledPackingIsAPrefix) {
  const MeshSolid solid(testing::closed(testing::icosphere_mesh(3), "icosphere"));
  PackingSettings settings = small(GridMode::uniform, 3000);
  settings.threads = 1;
  int calls = 0;
  const SpherePacking cut = pack(solid, settings, [&](const Progress& p) {
    EXPECT_LE(p.fraction, 1.0);
    return ++calls < 3;
  });
  if (calls < 3) GTEST_SKIP() << "packed before it could be cancelled";
  EXPECT_EQ(cut.stop, StopReason::cancelled);
  const SpherePacking whole = pack(solid, settings);
  testing::expect_prefix(cut, whole);
}

/// One cell for a whole needle: nothing but its one prototype a round.
TEST(GridPacking, AGridThatYieldsNothingMoreEnds) {
  const MeshSolid solid(testing::closed(
      testing::box_mesh(Eigen::Vector3d::Zero(), Eigen::Vector3d(1, 1e-6, 1e-6)), "needle"));
  PackingSettings settings = small(GridMode::explicit_refinement, 100);
  settings.grids.refinements = 0;
  const SpherePacking packing = pack(solid, settings);
  EXPECT_EQ(packing.stop, StopReason::exhausted);
  expect_certified(packing, solid);
}

TEST(GridPacking, WrongGridSettingsAreRefused) {
  const MeshSolid solid(testing::closed(testing::cube_mesh(), "cube"));
  PackingSettings settings = small(GridMode::hybrid, 10);
  settings.grids.start = 2000;
  EXPECT_THROW(pack(solid, settings), Error);
  settings.grids.start = 512;
  settings.grids.refinements = 4;
  EXPECT_THROW(pack(solid, settings), Error);
  const auto ball = make_ball({0, 0, 0}, 1);
  EXPECT_THROW(pack(*ball, small(GridMode::hybrid, 10)), Error);
}

}  // namespace
}  // namespace ist
