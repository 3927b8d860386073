#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include <ist/gpu_query.h>
#include <ist/types.h>

#include "cuda/base/check.h"
#include "cuda/base/queue.h"
#include "support/device_batch.h"
#include "support/exact_batches.h"
#include "support/gpu_test.h"
#include "support/mated_rows.h"

// Batches of exact penetrations on the GPU: the same bits as its source on the host, lane by lane,
// and the CPU's answers.

namespace ist::testing {
namespace {

class GpuExactTest : public GpuTest {};

std::vector<Penetration> ask_device(const std::vector<GpuSolid>& all,
                                    const std::vector<BatchPair>& pairs, int card = 0) {
  const gpu::DeviceGuard guard(card);
  GpuSettings settings;
  settings.device = card;
  const GpuSolids solids(all, settings);
  GpuWorkspace workspace(pairs.size(), settings);
  const Stream stream;
  const DeviceBatch first(pairs), second(pairs);
  for (const DeviceBatch* batch : {&first, &second})
    penetration_batch(solids, batch->pairs(), {Measure::exact}, workspace, batch->answers(),
                      stream);
  stream.wait();
  const std::vector<Penetration> answers = first.get();
  expect_same_bits(second.get(), answers);
  return answers;
}

TEST_F(GpuExactTest, HasTheBitsOfAWarpOnTheHost) {
  std::vector<BatchPair> pairs = exact_pairs(41, 60);
  for (const BatchPair& pair : aligned_pairs(42, 40)) pairs.push_back(pair);
  const std::vector<BatchPair> grazing = grazing_pairs();
  for (std::size_t k = 0; k < grazing.size(); k += 12) pairs.push_back(grazing[k]);
  pairs[20].pose_b.t[0] = std::nan("");
  pairs[30].scale_b = -1;
  pairs[40].a = 1000;
  HostBatch host(exact_solids());
  expect_same_bits(ask_device(exact_solids(), pairs), host.run(pairs, Measure::exact, 1));
}

TEST_F(GpuExactTest, EveryCardHasTheSameBits) {
  int cards = 0;
  gpu::check(cudaGetDeviceCount(&cards), "counting the cards");
  if (cards < 2) GTEST_SKIP() << "one card";
  const std::vector<BatchPair> pairs = aligned_pairs(47, 5000);
  const std::vector<Penetration> expected = ask_device(exact_solids(), pairs);
  for (int card = 1; card < cards; ++card)
    expect_same_bits(ask_device(exact_solids(), pairs, card), expected);
}

TEST_F(GpuExactTest, AGraphMayCaptureThem) {
  std::vector<BatchPair> pairs = exact_pairs(45, 5000);
  for (const BatchPair& pair : aligned_pairs(46, 5000)) pairs.push_back(pair);
  const std::vector<Penetration> expected = ask_device(exact_solids(), pairs);
  const GpuSolids solids(exact_solids());
  GpuWorkspace workspace(pairs.size());
  const Stream stream;
  const DeviceBatch batch(pairs);
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t ready = nullptr;
  gpu::check(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal), "capturing");
  penetration_batch(solids, batch.pairs(), {Measure::exact}, workspace, batch.answers(), stream);
  gpu::check(cudaStreamEndCapture(stream, &graph), "capturing");
  gpu::check(cudaGraphInstantiate(&ready, graph, 0), "making a graph");
  for (int k = 0; k < 3; ++k) gpu::check(cudaGraphLaunch(ready, stream), "launching a graph");
  stream.wait();
  expect_same_bits(batch.get(), expected);
  cudaGraphExecDestroy(ready);
  cudaGraphDestroy(graph);
}

/// Steps, in a graph too: the bits of a search, except the counts of nodes.
TEST_F(GpuExactTest, WhatIsKeptDoesNotShow) {
  std::vector<BatchPair> pairs = exact_pairs(48, 20'000);
  for (const BatchPair& pair : aligned_pairs(49, 10'000)) pairs.push_back(pair);
  const GpuSolids solids(exact_solids());
  GpuWorkspace workspace(pairs.size());
  const Stream stream;
  RandomPairs random(50);
  for (const std::size_t bytes_each : {1024u, 8192u}) {
    GpuKept kept(pairs.size(), bytes_each);
    std::size_t held = 0;
    for (int step = 0; step < 12; ++step) {
      const DeviceBatch batch(pairs), beside(pairs);
      cudaGraph_t graph = nullptr;
      cudaGraphExec_t ready = nullptr;
      gpu::check(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal), "capturing");
      penetration_batch(solids, batch.pairs(), {Measure::exact, 0, &kept}, workspace,
                        batch.answers(), stream);
      gpu::check(cudaStreamEndCapture(stream, &graph), "capturing");
      gpu::check(cudaGraphInstantiate(&ready, graph, 0), "making a graph");
      gpu::check(cudaGraphLaunch(ready, stream), "launching a graph");
      penetration_batch(solids, beside.pairs(), {Measure::exact}, workspace, beside.answers(),
                        stream);
      stream.wait();
      cudaGraphExecDestroy(ready);
      cudaGraphDestroy(graph);
      std::vector<Penetration> found = batch.get(), expected = beside.get();
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        held += found[i].node_visits == 0 && expected[i].node_visits != 0;
        found[i].node_visits = expected[i].node_visits = 0;
        const double by = std::pow(10.0, -2 - static_cast<double>(i % 5));
        for (double& t : pairs[i].pose_b.t) t += by * random.uniform(-1, 1);
        if (i % 2 == 0)
          for (double& q : pairs[i].pose_b.q) q += by * random.uniform(-1, 1);
      }
      expect_same_bits(found, expected);
      std::swap(pairs[7 * static_cast<std::size_t>(step)], pairs[9000]);
    }
    std::printf("%zu of %zu not searched\n", held, 12 * pairs.size());
    EXPECT_GT(held, pairs.size());
  }
}

TEST_F(GpuExactTest, AnswersAreTheCpus) {
  for (const std::vector<BatchPair>& pairs : {exact_pairs(43, 100'000), aligned_pairs(44, 30'000)})
    expect_near(compare_exactly(exact_assets(), pairs, ask_device(exact_solids(), pairs)));
}

/// For touching parts, also the area and normal of the faces that lie on each other.
TEST_F(GpuExactTest, MatesTouchAsOnTheCpu) {
  const MatedBatch mated(52, 2000);
  const Differences worst =
      compare_exactly(mated.assets, mated.pairs, ask_device(views_of(mated.assets), mated.pairs));
  EXPECT_GT(worst.flush, 1000u);
  expect_near(worst);
  const std::vector<BatchPair> grazing = grazing_pairs();
  expect_near(compare_exactly(exact_assets(), grazing, ask_device(exact_solids(), grazing)));
}

TEST_F(GpuExactTest, OracleRowsAreTheCpusAndTrue) {
  for (const std::string& key : kPairKeys) {
    if (key == "big200k") continue;
    std::vector<Asset> assets;
    std::map<std::string, std::uint32_t> number;
    std::vector<BatchPair> pairs;
    std::vector<double> truth;
    const auto asset = [&](const std::string& mesh) {
      const std::string path = oracle_mesh_path(mesh);
      const auto [at, fresh] = number.try_emplace(path, static_cast<std::uint32_t>(assets.size()));
      if (fresh) assets.push_back(surface(load_mesh(path)));
      return at->second;
    };
    for (const OracleRow& row : read_oracle_rows(key)) {
      BatchPair pair;
      pair.a = asset(row.mesh_a);
      pair.b = asset(row.mesh_b);
      pair.pose_b = row.pose;
      pair.scale_b = row.scale_b;
      pairs.push_back(pair);
      truth.push_back(row.volume);
    }
    const std::vector<Penetration> answers = ask_device(views_of(assets), pairs);
    std::printf("%s: ", key.c_str());
    expect_near(compare_exactly(assets, pairs, answers));
    for (std::size_t i = 0; i < pairs.size(); ++i)
      EXPECT_NEAR(answers[i].volume, truth[i], 1e-11 * (truth[i] + 1e-3)) << key << " " << i;
  }
}

TEST_F(GpuExactTest, MatedPartsAreTheCpusAndTrue) {
  std::vector<Asset> assets;
  std::map<std::string, std::uint32_t> number;
  std::vector<BatchPair> pairs;
  const std::vector<MatedRow> rows = read_mated_rows();
  const auto asset = [&](const std::string& mesh) {
    const auto [at, fresh] = number.try_emplace(mesh, static_cast<std::uint32_t>(assets.size()));
    if (fresh) assets.push_back(surface(load_mesh(mated_mesh_path(mesh))));
    return at->second;
  };
  for (const MatedRow& row : rows) {
    BatchPair pair;
    pair.a = asset(row.mesh_a);
    pair.b = asset(row.mesh_b);
    pair.pose_b = row.pose;
    pairs.push_back(pair);
  }
  const std::vector<Penetration> answers = ask_device(views_of(assets), pairs);
  const Differences worst = compare_exactly(assets, pairs, answers);
  EXPECT_GE(worst.flush, 8u);
  expect_near(worst);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double size = size_of({assets[pairs[i].a].view(), {}, 1});
    EXPECT_NEAR(answers[i].volume, rows[i].volume, 1e-12 * size * size * size)
        << rows[i].name << " " << rows[i].moved;
  }
}

}  // namespace
}  // namespace ist::testing
