#include <gtest/gtest.h>

#include <cuda_runtime_api.h>
#include <ist/gpu_query.h>
#include <ist/types.h>

#include <cmath>
#include <map>

#include "cuda/base/check.h"
#include "support/device_separations.h"
#include "support/gpu_test.h"
#include "support/host_separations.h"
#include "support/mated_rows.h"
#include "support/mesh_gaps.h"
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

TEST_F(GpuSeparationTest, SpheresAgreeWithSeparationOnTheOraclesRows) {
  IST_NEEDS_SHARED("oracle/poses/poses_eledino.csv");
  constexpr std::size_t kSpheres = 4000;
  std::vector<BatchPair> pairs;
  std::vector<std::pair<PlacedAsset, PlacedAsset>> of_cpu;
  std::vector<Asset> assets;
  for (const char* const mesh : {"elephant", "dino"})
    assets.push_back(baked(load_mesh(oracle_mesh_path(mesh)), mesh, kSpheres, false));
  for (const OracleRow& row : read_oracle_rows("eledino")) {
    of_cpu.push_back({{assets[0].view(), {}, 1}, {assets[1].view(), row.pose, row.scale_b}});
    pairs.push_back({0, 1, {}, row.pose, 1, row.scale_b});
  }
  const GpuSolids solids(views_of(assets));
  const std::vector<Separation> answers = on_device(solids, pairs);
  Workspace workspace;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Separation cpu = separation(of_cpu[i].first, of_cpu[i].second, {}, workspace);
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

/// Penetrations and separations may follow each other in one workspace, and a graph may contain
/// them.
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

/// Distances of meshes: the host's lanes have the same bits, and two runs.
TEST_F(GpuSeparationTest, MeshesHaveTheBitsOfAWarpOnTheHost) {
  std::vector<BatchPair> pairs = mesh_gap_pairs(51, 300);
  for (const BatchPair& pair : aligned_gap_pairs(52, 200)) pairs.push_back(pair);
  pairs[20].pose_b.t[0] = std::nan("");
  pairs[30].scale_b = -1;
  pairs[40].a = 1000;
  pairs[50].scale_b = 1e-6;
  pairs[60].pose_b.t[2] = 1e9;
  pairs[70].pose_b.t[2] = 1e30;
  const GpuSolids solids(exact_solids());
  for (const GpuSeparationSettings settings :
       {GpuSeparationSettings{}, GpuSeparationSettings{30, 0}, GpuSeparationSettings{0, 0.2}}) {
    HostSeparations host(exact_solids());
    expect_same_bits(on_device(solids, pairs, settings), host.run(pairs, 1, settings));
  }
}

TEST_F(GpuSeparationTest, RandomMeshesAnswerAsTheCpu) {
  const std::vector<BatchPair> pairs = mesh_gap_pairs(53, 100'000);
  const GpuSolids solids(exact_solids());
  const std::vector<Separation> found = on_device(solids, pairs);
  const GapDifferences differences = compare_gaps(exact_assets(), pairs, found);
  EXPECT_GT(differences.apart, 50'000u);
  EXPECT_LE(differences.other_points, 20u);
  expect_same_bits(on_device(solids, pairs), found);
}

TEST_F(GpuSeparationTest, AlignedMeshesAnswerAsTheCpu) {
  const std::vector<BatchPair> pairs = aligned_gap_pairs(54, 10'000);
  const GpuSolids solids(exact_solids());
  const std::vector<Separation> found = on_device(solids, pairs);
  const GapDifferences differences = compare_gaps(exact_assets(), pairs, found);
  EXPECT_GT(differences.apart, 2'000u);
  EXPECT_LE(differences.other_points, 20u);
  expect_same_bits(on_device(solids, pairs), found);
}

TEST_F(GpuSeparationTest, MeshesOfTheOraclesRowsAnswerAsTheCpu) {
  IST_NEEDS_SHARED("oracle/poses/poses_eledino.csv");
  for (const std::string& key : kPairKeys) {
    std::vector<BatchPair> pairs;
    const std::vector<OracleRow> rows = read_oracle_rows(key);
    std::vector<Asset> assets;
    for (const std::string& mesh : {rows[0].mesh_a, rows[0].mesh_b})
      assets.push_back(bake_mesh_only(close_mesh(load_mesh(oracle_mesh_path(mesh)), mesh), 0));
    for (const OracleRow& row : rows) pairs.push_back({0, 1, {}, row.pose, 1, row.scale_b});
    const GpuSolids solids(views_of(assets));
    const std::vector<Separation> found = on_device(solids, pairs);
    compare_gaps(assets, pairs, found);
    for (std::size_t i = 0; i < rows.size(); ++i)
      EXPECT_NEAR(found[i].distance, rows[i].solid_distance(), 1e-9) << key << " " << i;
  }
}

/// One part on another, each part once as it is and once moved along the mate.
TEST_F(GpuSeparationTest, MatedPartsAnswerAsTheCpu) {
  IST_NEEDS_SHARED("oracle/mated/poses.csv");
  std::map<std::string, std::uint32_t> number;
  std::vector<Asset> assets;
  std::vector<BatchPair> pairs;
  for (const MatedRow& row : read_mated_rows()) {
    for (const std::string& mesh : {row.mesh_a, row.mesh_b})
      if (number.try_emplace(mesh, static_cast<std::uint32_t>(assets.size())).second)
        assets.push_back(bake_mesh_only(close_mesh(load_mesh(mated_mesh_path(mesh)), mesh), 0));
    pairs.push_back({number[row.mesh_a], number[row.mesh_b], {}, row.pose});
    pairs.push_back(pairs.back());
    for (double& t : pairs.back().pose_b.t) t *= 1.25;
  }
  const GpuSolids solids(views_of(assets));
  const GapDifferences differences = compare_gaps(assets, pairs, on_device(solids, pairs));
  EXPECT_GT(differences.apart, 20u);
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
