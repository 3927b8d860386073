#include "cuda/packing/banded/banded_pack.h"

#include <ist/bake.h>
#include <ist/types.h>

#include <chrono>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include "cuda/packing/mesh/device_mesh.h"
#include "mesh/mesh_solid.h"
#include "mesh/samples/samples.h"
#include "packing/base/packing_settings.h"
#include "support/gpu_test.h"
#include "support/same_packing.h"
#include "support/scarce_memory.h"
#include "support/shared_data.h"
#include "support/test_meshes.h"

// The GPU's banded packing against the CPU's: the same bytes.

namespace ist::testing {
namespace {

class BandedGpuTest : public GpuTest {};

SpherePacking pack_on_gpu(const MeshSolid& solid, const PackingSettings& settings,
                          const ProgressCallback& progress = {}) {
  gpu::Queue queue(settings.gpu);
  const gpu::DeviceMesh mesh(queue, solid.view());
  Stage stage("pack", progress, settings.time_limit);
  return gpu::pack_banded(queue, mesh.tree(),
                          packing::packing_limits(solid, solid.frame().scale(), settings), stage);
}

void compare(const ClosedMesh& mesh, const std::vector<PackingSettings>& cases) {
  const MeshSolid solid(mesh);
  for (const PackingSettings& settings : cases) {
    SCOPED_TRACE(mesh.name + ", case " + std::to_string(&settings - cases.data()));
    PackingSettings on_cpu = settings;
    on_cpu.device = Device::cpu;
    expect_same(pack_on_gpu(solid, settings), pack(solid, on_cpu));
  }
}

std::vector<PackingSettings> counts(const std::vector<std::size_t>& wanted) {
  std::vector<PackingSettings> cases;
  for (const std::size_t count : wanted) {
    cases.emplace_back();
    cases.back().max_spheres = count;
  }
  return cases;
}

TEST_F(BandedGpuTest, SamplesGiveTheCpusSpheres) {
  for (const char* name : {"bolt", "nut", "gear"})
    compare(close_mesh(make_sample(name), name), counts({100, 1000, 10000}));
}

TEST_F(BandedGpuTest, EquallyGoodPlacesGiveTheCpusSpheres) {
  compare(closed(cube_mesh(), "cube"), counts({1, 10, 100, 1000, 10000}));
  compare(closed(icosphere_mesh(3), "icosphere"), counts({100, 1000}));
  compare(closed(torus_mesh(1, 0.1, 90, 24), "torus"), counts({100, 1000}));
}

TEST_F(BandedGpuTest, EveryStopAndSettingGivesTheCpusSpheres) {
  std::vector<PackingSettings> cases(6);
  cases[0].max_spheres = 0;
  cases[0].target_coverage = 0.8;
  cases[1].max_spheres = 0;
  cases[1].min_radius = 0.03;
  cases[2].max_spheres = 500;
  cases[2].epsilon = 0.1;
  cases[3].max_spheres = 500;
  cases[3].seed = 7;
  cases[4].max_spheres = 0;
  cases[4].epsilon = 0.2;
  cases[4].min_radius = 0.05;
  cases[5].max_spheres = 2000;
  cases[5].min_radius = 0.02;
  compare(closed(torus_mesh(1, 0.3, 60, 24), "torus"), cases);
  compare(closed(cube_mesh(), "cube"), cases);
}

TEST_F(BandedGpuTest, SharedMeshesGiveTheCpusSpheres) {
  for (const char* file : {"oracle/meshes/dino.off", "oracle/meshes/elephant.off",
                           "oracle/meshes/ico20k.off", "meshes/dev/unit_cube.stl"}) {
    IST_NEEDS_SHARED(file);
    compare(close_mesh(load_mesh(shared_path(file).string()), file), counts({100, 1000, 10000}));
  }
}

TEST_F(BandedGpuTest, TwoStreamsAtOnceGiveWhatOneGives) {
  const MeshSolid bolt(close_mesh(make_sample("bolt"), "bolt"));
  const MeshSolid gear(close_mesh(make_sample("gear"), "gear"));
  PackingSettings settings;
  settings.max_spheres = 3000;
  const SpherePacking bolt_alone = pack_on_gpu(bolt, settings);
  const SpherePacking gear_alone = pack_on_gpu(gear, settings);
  for (int repeat = 0; repeat < 5; ++repeat) {
    SpherePacking bolt_beside;
    std::thread other([&] { bolt_beside = pack_on_gpu(bolt, settings); });
    const SpherePacking gear_beside = pack_on_gpu(gear, settings);
    other.join();
    expect_same(bolt_beside, bolt_alone);
    expect_same(gear_beside, gear_alone);
  }
}

TEST_F(BandedGpuTest, TooLittleMemoryIsAnErrorAtAnyPointAndLeaksNothing) {
  const MeshSolid solid(close_mesh(make_sample("bolt"), "bolt"));
  for (const std::size_t megabytes : {1, 12, 20, 40}) {
    ScarceMemory memory(megabytes << 20);
    PackingSettings settings;
    settings.max_spheres = 0;
    settings.min_radius = 1e-3;
    settings.gpu.memory = &memory;
    EXPECT_THROW(pack_on_gpu(solid, settings), Error) << megabytes;
    EXPECT_EQ(memory.left(), megabytes << 20);
  }
}

TEST_F(BandedGpuTest, CancelAndTimeLimitLeaveAValidPrefix) {
  const MeshSolid solid(close_mesh(make_sample("bolt"), "bolt"));
  PackingSettings settings;
  settings.max_spheres = 300000;
  pack_on_gpu(solid, settings);  // the first has the GPU to ready
  const auto began = std::chrono::steady_clock::now();
  const SpherePacking whole = pack_on_gpu(solid, settings);
  const std::chrono::duration<double> takes = std::chrono::steady_clock::now() - began;
  int calls = 0, calls_with_spheres = 0;
  const SpherePacking cancelled = pack_on_gpu(solid, settings, [&](const Progress& p) {
    EXPECT_LE(p.spheres, settings.max_spheres);
    ++calls;
    calls_with_spheres += p.spheres > 0 ? 1 : 0;
    return p.spheres == 0;
  });
  EXPECT_GE(calls, 2);  // the first as the stage begins
  EXPECT_EQ(calls_with_spheres, 1);
  EXPECT_EQ(cancelled.stop, StopReason::cancelled);
  settings.time_limit = takes.count() / 2;
  const SpherePacking timed = pack_on_gpu(solid, settings);
  EXPECT_EQ(timed.stop, StopReason::time_limit);
  for (const SpherePacking* packing : {&cancelled, &timed}) {
    ASSERT_LT(packing->spheres.size(), whole.spheres.size());
    EXPECT_GT(packing->spheres.size(), 0u);
    EXPECT_EQ(std::memcmp(packing->spheres.data(), whole.spheres.data(),
                          packing->spheres.size() * sizeof(Sphere)),
              0);
  }
}

}  // namespace
}  // namespace ist::testing
