#include <gtest/gtest.h>

#include <cuda_runtime_api.h>
#include <ist/gpu_query.h>
#include <ist/types.h>

#include <cmath>

#include "cuda/check.h"
#include "support/device_separations.h"
#include "support/gpu_test.h"
#include "support/host_separations.h"
#include "support/oracle_assets.h"
#include "support/random_pairs.h"

// Batches of separations on the GPU against the same source on the host, lane by lane: the same
// bits; and against separation().

namespace ist::testing {
namespace {

class GpuSeparationTest : public GpuTest {
 protected:
  std::vector<Separation> on_device(const GpuSolids& solids, const std::vector<BatchPair>& pairs,
                                    const GpuSeparationSettings& settings = {}) {
    GpuWorkspace workspace(pairs.size());
    const DeviceBatch batch(pairs);
    const DeviceSeparations answers(pairs.size());
    const Stream stream;
    separation_batch(solids, batch.pairs(), settings, workspace, answers.answers(), stream);
    stream.wait();
    return answers.get();
  }
};

TEST_F(GpuSeparationTest, HasTheBitsOfAWarpOnTheHost) {
  std::vector<BatchPair> pairs = RandomPairs(31).pairs_at_all_distances(600);
  pairs[20].pose_b.t[0] = std::nan("");
  pairs[30].scale_b = -1;
  pairs[40].a = 1000;
  pairs[50].scale_b = 1e-6;
  pairs[60].pose_b.t[2] = 1e9;
  pairs[70].pose_b.t[2] = 1e30;
  const GpuSolids solids(batch_solids());
  for (const std::uint32_t most : {0u, 7u, 250u}) {
    HostSeparations host(batch_solids());
    expect_same_bits(on_device(solids, pairs, {most}), host.run(pairs, 0, {most}));
    EXPECT_EQ(host.counters[0].tasks > 50, most != 7);
  }
}

TEST_F(GpuSeparationTest, AgreesWithSeparationOnTheOraclesRows) {
  IST_NEEDS_SHARED("oracle/poses/poses_eledino.csv");
  constexpr std::size_t kSpheres = 4000;
  std::vector<BatchPair> pairs;
  std::vector<std::pair<PlacedAsset, PlacedAsset>> of_cpu;
  for (const OracleRow& row : read_oracle_rows("eledino")) {
    of_cpu.push_back(placed(row, kSpheres));
    pairs.push_back({0, 1, {}, row.pose, 1, row.scale_b});
  }
  const GpuSolids solids(std::vector<GpuSolid>{of_cpu[0].first.asset, of_cpu[0].second.asset});
  const std::vector<Separation> answers = on_device(solids, pairs);
  Workspace workspace;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Separation cpu =
        separation(of_cpu[i].first, of_cpu[i].second, {.inner_spheres = true}, workspace);
    EXPECT_NEAR(answers[i].distance, cpu.distance, 1e-6 * cpu.distance) << i;
    EXPECT_LE(answers[i].distance, cpu.distance_max) << i;
    EXPECT_GE(answers[i].distance_min, cpu.distance_min - 1e-12) << i;
    EXPECT_LE(answers[i].distance_min, cpu.distance_min + 1e-5) << i;
  }
}

TEST_F(GpuSeparationTest, ManyPairsHaveTheSameBitsInEveryRun) {
  const std::vector<BatchPair> some = RandomPairs(32).pairs_at_all_distances(3000);
  std::vector<BatchPair> pairs;
  for (std::size_t i = 0; i < 300000; ++i) pairs.push_back(some[(i * 7919) % some.size()]);
  const GpuSolids solids(batch_solids());
  const std::vector<Separation> expected = on_device(solids, some);
  std::vector<Separation> repeated;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    repeated.push_back(expected[(i * 7919) % some.size()]);
  expect_same_bits(on_device(solids, pairs), repeated);
}

/// Penetrations and separations may follow each other in one workspace, and a graph may hold them.
TEST_F(GpuSeparationTest, AGraphMayCaptureItBesidePenetrations) {
  const std::vector<BatchPair> pairs = RandomPairs(33).pairs_at_all_distances(500);
  const GpuSolids solids(batch_solids());
  const std::vector<Separation> expected = on_device(solids, pairs);
  GpuWorkspace workspace(pairs.size());
  const Stream stream;
  const DeviceBatch batch(pairs), direct(pairs);
  const DeviceSeparations captured(pairs.size());
  penetration_batch(solids, direct.pairs(), {Measure::matched}, workspace, direct.answers(),
                    stream);
  stream.wait();
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t ready = nullptr;
  gpu::check(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal), "capturing");
  separation_batch(solids, batch.pairs(), {}, workspace, captured.answers(), stream);
  penetration_batch(solids, batch.pairs(), {Measure::matched}, workspace, batch.answers(), stream);
  gpu::check(cudaStreamEndCapture(stream, &graph), "capturing");
  gpu::check(cudaGraphInstantiate(&ready, graph, 0), "making a graph");
  for (int k = 0; k < 3; ++k) gpu::check(cudaGraphLaunch(ready, stream), "launching a graph");
  stream.wait();
  expect_same_bits(captured.get(), expected);
  expect_same_bits(batch.get(), direct.get());
  cudaGraphExecDestroy(ready);
  cudaGraphDestroy(graph);
}

TEST_F(GpuSeparationTest, WhatDoesNotFitIsAnError) {
  const GpuSolids solids(batch_solids());
  const std::vector<BatchPair> pairs = RandomPairs(34).pairs_at_all_distances(5);
  GpuWorkspace workspace(4);
  const DeviceBatch batch(pairs);
  const DeviceSeparations answers(pairs.size());
  EXPECT_THROW(separation_batch(solids, batch.pairs(), {}, workspace, answers.answers(), nullptr),
               Error);
  EXPECT_TRUE(on_device(solids, {}).empty());
  // Nothing is wanted: nothing is written.
  const DeviceBatch four({pairs.begin(), pairs.begin() + 4});
  separation_batch(solids, four.pairs(), {}, workspace, {}, nullptr);
  gpu::check(cudaDeviceSynchronize(), "waiting");
}

}  // namespace
}  // namespace ist::testing
