#include <gtest/gtest.h>

#include <cuda_runtime_api.h>
#include <ist/gpu_query.h>
#include <ist/types.h>

#include <cmath>

#include "cuda/base/check.h"
#include "support/detailed_pairs.h"
#include "support/device_patches.h"
#include "support/exact_patch_checks.h"
#include "support/gpu_test.h"
#include "support/host_patches.h"
#include "support/random_pairs.h"

// Batches of contact patches on the GPU against the same source on the host, lane by lane: the same
// bits.

namespace ist::testing {
namespace {

class GpuPatchesTest : public GpuTest {
 protected:
  std::vector<PatchedPair> on_device(const GpuSolids& solids, const std::vector<BatchPair>& pairs,
                                     Measure measure, std::uint32_t most) {
    GpuWorkspace workspace(pairs.size());
    const DeviceBatch batch(pairs);
    const DevicePatches patches(pairs.size(), most);
    const Stream stream;
    contact_patches_batch(solids, batch.pairs(), measure, workspace, batch.answers(),
                          patches.patches(), stream);
    stream.wait();
    return patches.get(batch.get());
  }
};

TEST_F(GpuPatchesTest, HaveTheBitsOfAWarpOnTheHost) {
  std::vector<BatchPair> pairs = RandomPairs(51).pairs(150);
  pairs[20].pose_b.t[0] = std::nan("");
  pairs[30].scale_b = -1;
  pairs[40].a = 1000;
  const GpuSolids solids(batch_solids());
  for (const Measure measure : {Measure::matched, Measure::inner})
    for (const std::uint32_t most : {0u, 1u, 6u, kMostGpuPatches})
      expect_same_bits(on_device(solids, pairs, measure, most),
                       HostPatches(batch_solids()).run(pairs, measure, most, 1));
}

/// Assets with thousands of spheres, and copies at one pose.
TEST_F(GpuPatchesTest, LargeContactsHaveTheBitsOfAWarpOnTheHost) {
  std::vector<BatchPair> pairs = detailed_pairs(30, 52);
  for (const BatchPair& copy : copies_in_place(12, 53)) pairs.push_back(copy);
  const GpuSolids solids(detailed_solids());
  expect_same_bits(on_device(solids, pairs, Measure::matched, 8),
                   HostPatches(detailed_solids()).run(pairs, Measure::matched, 8, 1));
}

TEST_F(GpuPatchesTest, ManyPairsHaveTheSameBitsInEveryRun) {
  const std::vector<BatchPair> some = RandomPairs(54).pairs(3000);
  std::vector<BatchPair> pairs;
  for (std::size_t i = 0; i < 300000; ++i) pairs.push_back(some[(i * 7919) % some.size()]);
  const GpuSolids solids(batch_solids());
  const std::vector<PatchedPair> expected = on_device(solids, some, Measure::matched, 4);
  std::vector<PatchedPair> repeated;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    repeated.push_back(expected[(i * 7919) % some.size()]);
  expect_same_bits(on_device(solids, pairs, Measure::matched, 4), repeated);
}

/// Patches and penetrations may follow each other in one workspace, and a graph may contain them.
TEST_F(GpuPatchesTest, AGraphMayCaptureThemBesidePenetrations) {
  const std::vector<BatchPair> pairs = RandomPairs(55).pairs(500);
  const GpuSolids solids(batch_solids());
  const std::vector<PatchedPair> expected = on_device(solids, pairs, Measure::matched, 5);
  GpuWorkspace workspace(pairs.size());
  const Stream stream;
  const DeviceBatch direct(pairs), batch(pairs), wholes(pairs);
  const DevicePatches captured(pairs.size(), 5);
  penetration_batch(solids, direct.pairs(), {Measure::matched}, workspace, direct.answers(),
                    stream);
  stream.wait();
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t ready = nullptr;
  gpu::check(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal), "capturing");
  contact_patches_batch(solids, wholes.pairs(), Measure::matched, workspace, wholes.answers(),
                        captured.patches(), stream);
  penetration_batch(solids, batch.pairs(), {Measure::matched}, workspace, batch.answers(), stream);
  gpu::check(cudaStreamEndCapture(stream, &graph), "capturing");
  gpu::check(cudaGraphInstantiate(&ready, graph, 0), "making a graph");
  for (int k = 0; k < 3; ++k) gpu::check(cudaGraphLaunch(ready, stream), "launching a graph");
  stream.wait();
  expect_same_bits(captured.get(wholes.get()), expected);
  expect_same_bits(batch.get(), direct.get());
  cudaGraphExecDestroy(ready);
  cudaGraphDestroy(graph);
}

/// Measure::exact in general poses, aligned ones, mates, and for invalid queries.
TEST_F(GpuPatchesTest, ExactOnesHaveTheBitsOfAWarpOnTheHost) {
  std::vector<BatchPair> pairs = exact_pairs(57, 60);
  for (const BatchPair& pair : aligned_pairs(58, 60)) pairs.push_back(pair);
  pairs[20].pose_b.t[0] = std::nan("");
  pairs[30].scale_b = -1;
  pairs[40].a = 1000;
  const MatedBatch mated(59, 20);
  for (const std::uint32_t most : {0u, 1u, 6u, kMostGpuPatches}) {
    expect_same_bits(on_device(GpuSolids(exact_solids()), pairs, Measure::exact, most),
                     HostPatches(exact_solids()).run(pairs, Measure::exact, most, 1));
    expect_same_bits(
        on_device(GpuSolids(views_of(mated.assets)), mated.pairs, Measure::exact, most),
        HostPatches(views_of(mated.assets)).run(mated.pairs, Measure::exact, most, 1));
  }
}

TEST_F(GpuPatchesTest, ExactOnesAreTheCpus) {
  const GpuSolids solids(exact_solids());
  for (const std::uint32_t most : {1u, 4u, 16u})
    for (const std::vector<BatchPair>& pairs : {exact_pairs(60, 10'000), aligned_pairs(61, 10'000)})
      expect_near(compare_patches(exact_assets(), pairs,
                                  on_device(solids, pairs, Measure::exact, most), most));
  const MatedBatch mated(62, 2000);
  expect_near(compare_patches(
      mated.assets, mated.pairs,
      on_device(GpuSolids(views_of(mated.assets)), mated.pairs, Measure::exact, 8), 8));
}

TEST_F(GpuPatchesTest, AGraphMayCaptureExactOnes) {
  std::vector<BatchPair> pairs = exact_pairs(63, 5000);
  for (const BatchPair& pair : aligned_pairs(64, 5000)) pairs.push_back(pair);
  const GpuSolids solids(exact_solids());
  const std::vector<PatchedPair> expected = on_device(solids, pairs, Measure::exact, 5);
  GpuWorkspace workspace(pairs.size());
  const Stream stream;
  const DeviceBatch wholes(pairs), alone(pairs);
  const DevicePatches captured(pairs.size(), 5);
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t ready = nullptr;
  gpu::check(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal), "capturing");
  contact_patches_batch(solids, wholes.pairs(), Measure::exact, workspace, wholes.answers(),
                        captured.patches(), stream);
  penetration_batch(solids, alone.pairs(), {Measure::exact}, workspace, alone.answers(), stream);
  gpu::check(cudaStreamEndCapture(stream, &graph), "capturing");
  gpu::check(cudaGraphInstantiate(&ready, graph, 0), "making a graph");
  for (int k = 0; k < 3; ++k) gpu::check(cudaGraphLaunch(ready, stream), "launching a graph");
  stream.wait();
  expect_same_bits(captured.get(wholes.get()), expected);
  expect_same_bits(alone.get(), wholes.get());
  cudaGraphExecDestroy(ready);
  cudaGraphDestroy(graph);
}

TEST_F(GpuPatchesTest, WhatDoesNotFitIsAnError) {
  const GpuSolids solids(batch_solids());
  const std::vector<BatchPair> pairs = RandomPairs(56).pairs(5);
  GpuWorkspace workspace(4);
  const DeviceBatch batch(pairs), four({pairs.begin(), pairs.begin() + 4});
  const DevicePatches patches(pairs.size(), 2);
  EXPECT_THROW(contact_patches_batch(solids, batch.pairs(), Measure::matched, workspace,
                                     batch.answers(), patches.patches(), nullptr),
               Error);
  GpuContactPatches too_many;
  too_many.most = kMostGpuPatches + 1;
  EXPECT_THROW(contact_patches_batch(solids, four.pairs(), Measure::matched, workspace,
                                     four.answers(), too_many, nullptr),
               Error);
  EXPECT_TRUE(on_device(solids, {}, Measure::matched, 3).empty());
  // Nothing is wanted: nothing is written.
  GpuContactPatches none;
  none.most = 7;
  contact_patches_batch(solids, four.pairs(), Measure::matched, workspace, {}, none, nullptr);
  gpu::check(cudaDeviceSynchronize(), "waiting");
}

}  // namespace
}  // namespace ist::testing
