#include <ist/bake.h>

#include <thread>

#include "base/thread_arena.h"
#include "cuda/base/queue.h"
#include "cuda/packing/grids/pack_grids.h"
#include "mesh/mesh_solid.h"
#include "mesh/samples/samples.h"
#include "support/certified_packing.h"
#include "support/gpu_test.h"
#include "support/grid_history.h"
#include "support/shared_data.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

using testing::same_bytes;

class GridPackingGpuTest : public testing::GpuTest {};

constexpr GridMode kGridModes[] = {GridMode::uniform, GridMode::explicit_refinement,
                                   GridMode::implicit_refinement, GridMode::hybrid};

PackingSettings small(GridMode mode, std::size_t spheres) {
  PackingSettings settings;
  settings.grid = mode;
  settings.max_spheres = spheres;
  if (mode == GridMode::uniform) {
    settings.grids.resolution = 32;
  } else {
    settings.grids.start = 4;
    settings.grids.refinements = 3;
    settings.grids.resolution = mode == GridMode::implicit_refinement ? 32 : 8;
  }
  return settings;
}

SpherePacking on_cpu(const MeshSolid& solid, const PackingSettings& settings) {
  Stage stage("pack", {});
  return thread_arena(0).execute([&] { return packing::pack_grids(solid, settings, stage); });
}

SpherePacking on_gpu(const MeshSolid& solid, const PackingSettings& settings) {
  gpu::Queue queue{GpuSettings{}};
  Stage stage("pack", {});
  SpherePacking packing = gpu::pack_grids(queue, solid, settings, stage);
  EXPECT_EQ(queue.bytes_in_use(), 0u);
  return packing;
}

void expect_same_bytes(const ClosedMesh& mesh) {
  const MeshSolid solid(mesh);
  for (const GridMode mode : kGridModes)
    for (const std::uint64_t seed : {0u, 7u}) {
      SCOPED_TRACE(mesh.name + ", mode " + std::to_string(static_cast<int>(mode)));
      PackingSettings settings = small(mode, 400);
      settings.seed = seed;
      EXPECT_TRUE(same_bytes(on_cpu(solid, settings), on_gpu(solid, settings)));
    }
}

TEST_F(GridPackingGpuTest, TheSameBytesAsTheCpu) {
  expect_same_bytes(testing::closed(testing::cube_mesh(), "cube"));
  expect_same_bytes(testing::closed(testing::icosphere_mesh(3), "icosphere"));
  expect_same_bytes(testing::closed(testing::overlapping_cubes_mesh(), "overlapping cubes"));
  expect_same_bytes(close_mesh(make_sample("bolt"), "bolt"));
}

TEST_F(GridPackingGpuTest, TheSameBytesOnTheDino) {
  IST_NEEDS_SHARED("oracle/meshes/dino.off");
  expect_same_bytes(
      close_mesh(load_mesh(testing::shared_path("oracle/meshes/dino.off").string()), "dino"));
}

TEST_F(GridPackingGpuTest, OtherStopsAreTheSame) {
  const MeshSolid solid(testing::closed(testing::cube_mesh(), "cube"));
  PackingSettings settings = small(GridMode::hybrid, 0);
  settings.target_coverage = 0.6;
  EXPECT_TRUE(same_bytes(on_cpu(solid, settings), on_gpu(solid, settings)));
  settings.target_coverage = 1;
  settings.min_radius = 0.08;
  EXPECT_TRUE(same_bytes(on_cpu(solid, settings), on_gpu(solid, settings)));
}

TEST_F(GridPackingGpuTest, TwoAtOnceDoNotDisturbEachOther) {
  const MeshSolid bolt(close_mesh(make_sample("bolt"), "bolt"));
  const MeshSolid ball(testing::closed(testing::icosphere_mesh(3), "icosphere"));
  const PackingSettings settings = small(GridMode::hybrid, 400);
  const SpherePacking bolt_alone = on_gpu(bolt, settings), ball_alone = on_gpu(ball, settings);
  for (int round = 0; round < 3; ++round) {
    SpherePacking bolt_again, ball_again;
    std::thread other([&] { bolt_again = on_gpu(bolt, settings); });
    ball_again = on_gpu(ball, settings);
    other.join();
    EXPECT_TRUE(same_bytes(bolt_alone, bolt_again));
    EXPECT_TRUE(same_bytes(ball_alone, ball_again));
  }
}

TEST_F(GridPackingGpuTest, TheMemoryOfInactiveCellsIsGivenBack) {
  const MeshSolid solid(testing::closed(testing::icosphere_mesh(3), "icosphere"));
  gpu::Queue queue{GpuSettings{}};
  PackingSettings settings = small(GridMode::implicit_refinement, 300);
  settings.grids.resolution = 128;
  const std::vector<testing::GridRound> history = testing::history_on_grids(queue, solid, settings);
  ASSERT_GE(history.size(), 3u);
  EXPECT_LT(history.back().active_cells, history.front().active_cells / 3);
  EXPECT_LT(history.back().bytes, history.front().bytes / 2);
  EXPECT_LT(history.back().bytes, history.back().dense_bytes / 5);
}

TEST_F(GridPackingGpuTest, TheSameMedialNodes) {
  const MeshSolid solid(close_mesh(make_sample("bolt"), "bolt"));
  MedialSettings settings;
  settings.resolution = 40;
  settings.device = Device::cpu;
  const std::vector<MedialNode> cpu = medial_nodes(solid, settings);
  settings.device = Device::cuda;
  const std::vector<MedialNode> gpu = medial_nodes(solid, settings);
  ASSERT_EQ(cpu.size(), gpu.size());
  EXPECT_GT(cpu.size(), 100u);
  for (std::size_t i = 0; i < cpu.size(); ++i) {
    EXPECT_EQ(cpu[i].point, gpu[i].point);
    EXPECT_EQ(cpu[i].radius, gpu[i].radius);
    EXPECT_EQ(cpu[i].contacts, gpu[i].contacts);
  }
}

}  // namespace
}  // namespace ist
