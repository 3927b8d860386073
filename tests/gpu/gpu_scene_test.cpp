#include <gtest/gtest.h>
#include <ist/gpu_scene.h>
#include <ist/query.h>

#include <cmath>

#include "support/answer_bits.h"
#include "support/device_batch.h"
#include "support/gpu_test.h"
#include "support/random_scene.h"

// The broad phase of scenes on the device, beside Scene.

namespace ist::testing {
namespace {

class GpuSceneTest : public GpuTest {};

template <class T>
std::vector<T> from_device(const T* from, std::size_t count) {
  std::vector<T> out(count);
  gpu::check(cudaMemcpy(out.data(), from, count * sizeof(T), cudaMemcpyDeviceToHost),
             "copying from the GPU");
  return out;
}

NamedPairs names_of(const GpuScenePairs& found) {
  const std::size_t count = from_device(found.count, 1)[0];
  const auto a = from_device(found.a, count), b = from_device(found.b, count);
  NamedPairs out;
  for (std::size_t k = 0; k < count; ++k) out.emplace_back(a[k], b[k]);
  return out;
}

TEST_F(GpuSceneTest, HasThePairsOfScene) {
  const std::vector<GpuSolid> any = some_solids();
  const GpuSolids solids(any);
  const Stream stream;
  unsigned seed = 0;
  std::size_t pairs = 0;
  for (const std::size_t count : {0, 1, 33, 1'000, 40'000}) {
    for (const std::uint32_t worlds : {1u, 7u, 50u}) {
      RandomScene random(any, count, worlds, ++seed);
      random.settings.excluded = random.excluded;
      GpuScene scene(solids, random.bodies, random.settings);
      for (int step = 0; step < 2; ++step) {
        const OnDevice<Pose> poses(random.poses);
        scene.find_pairs(poses.data(), stream);
        stream.wait();
        const auto [expected, left_out] = random.by_scene();
        ASSERT_EQ(names_of(scene.pairs()), expected) << count << " " << worlds;
        std::vector<std::uint32_t> bad;
        const auto status = from_device(scene.pairs().status, count);
        for (std::uint32_t i = 0; i < count; ++i)
          if (status[i] != QueryStatus::ok) bad.push_back(i);
        EXPECT_EQ(bad, left_out);
        pairs += expected.size();
        random.move(3 * std::cbrt(static_cast<double>(count) / worlds));
      }
    }
  }
  std::printf("%zu pairs\n", pairs);
}

/// Broad phase and exact answers in one graph: worlds of 32 cubes, flush, turned and random.
TEST_F(GpuSceneTest, AGraphAsksThePairsThatAStepFinds) {
  constexpr std::size_t kPairs = 1 << 16;
  const std::vector<GpuSolid> any = {some_solids()[0], some_solids()[1]};
  const GpuSolids solids(any);
  RandomScene random(any, 3'200, 100, 77);
  random.settings.max_pairs = kPairs;
  random.settings.measure = Measure::exact;
  random.settings.excluded = random.excluded;
  GpuScene scene(solids, random.bodies, random.settings);
  GpuWorkspace workspace(kPairs);
  const OnDevice<double> volume(kPairs);
  const OnDevice<QueryStatus> status(kPairs);
  GpuPenetrations answers;
  answers.volume = volume.data();
  answers.status = status.data();
  const OnDevice<Pose> poses(random.poses);
  const Stream stream;
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t ready = nullptr;
  gpu::check(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal), "capturing");
  scene.find_pairs(poses.data(), stream);
  penetration_batch(solids, scene.pairs().pairs, {Measure::exact}, workspace, answers, stream);
  gpu::check(cudaStreamEndCapture(stream, &graph), "capturing");
  gpu::check(cudaGraphInstantiate(&ready, graph, 0), "making a graph");
  Workspace cpu;
  for (int step = 0; step < 3; ++step) {
    gpu::check(cudaMemcpy(poses.data(), random.poses.data(), random.poses.size() * sizeof(Pose),
                          cudaMemcpyHostToDevice),
               "moving");
    gpu::check(cudaGraphLaunch(ready, stream), "launching a graph");
    stream.wait();
    const NamedPairs found = names_of(scene.pairs());
    ASSERT_EQ(found, random.by_scene().first);
    EXPECT_GT(found.size(), 1000u);
    const auto volumes = volume.get();
    const auto statuses = status.get();
    for (std::size_t k = 0; k < kPairs; ++k) {
      if (k >= found.size()) {
        ASSERT_EQ(statuses[k], QueryStatus::invalid_input) << k;
        ASSERT_TRUE(std::isnan(volumes[k])) << k;
        continue;
      }
      const auto placed = [&](std::uint32_t i) {
        return PlacedAsset{std::get<AssetView>(any[random.bodies[i].solid]), random.poses[i],
                           random.bodies[i].scale};
      };
      PenetrationSettings exact;
      exact.measure = Measure::exact;
      const Penetration expected =
          penetration(placed(found[k].first), placed(found[k].second), exact, cpu);
      ASSERT_EQ(statuses[k], expected.status) << k;
      const double size = std::pow(
          std::min(random.bodies[found[k].first].scale, random.bodies[found[k].second].scale), 3);
      if (expected.status == QueryStatus::ok) {
        ASSERT_NEAR(volumes[k], expected.volume, 1e-11 * size) << k;
      }
    }
    random.move(3);
  }
  cudaGraphExecDestroy(ready);
  cudaGraphDestroy(graph);
}

}  // namespace
}  // namespace ist::testing
