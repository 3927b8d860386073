#include <gtest/gtest.h>

#include <cuda_runtime_api.h>
#include <ist/gpu_query.h>
#include <ist/types.h>

#include "cuda/base/check.h"
#include "support/detailed_pairs.h"
#include "support/device_batch.h"
#include "support/gpu_test.h"
#include "support/host_batch.h"
#include "support/random_pairs.h"
#include "support/surface_queries.h"

// Batches of penetrations on the GPU against the same source on the host, lane by lane: the same
// bits.

namespace ist::testing {
namespace {

class GpuQueryTest : public GpuTest {};

TEST_F(GpuQueryTest, HasTheBitsOfAWarpOnTheHost) {
  std::vector<BatchPair> pairs = RandomPairs(11).pairs(150);
  pairs[20].pose_b.t[0] = std::nan("");
  pairs[30].scale_b = -1;
  pairs[40].a = 1000;
  const GpuSolids solids(batch_solids());
  const Stream stream;
  for (const std::size_t most_pairs : {pairs.size(), kFewGpuPairs + 1}) {
    GpuWorkspace workspace(most_pairs);
    for (const Measure measure : {Measure::matched, Measure::inner}) {
      const DeviceBatch batch(pairs);
      penetration_batch(solids, batch.pairs(), {measure}, workspace, batch.answers(), stream);
      stream.wait();
      HostBatch host(batch_solids());
      host.cut_for(most_pairs);
      expect_same_bits(batch.get(), host.run(pairs, measure, 1));
    }
  }
}

/// Trees, all fields that a GPU knows, and one that is not sound: pairs of trees, of a tree and a
/// field in either order, of two fields, and of one solid too many.
struct MixedScene {
  std::vector<GpuSolid> solids = batch_solids();
  std::vector<BatchPair> pairs;

  explicit MixedScene(std::size_t count) {
    for (const auto& [name, field] : fields())
      if (!std::holds_alternative<FunctionShape>(field)) solids.emplace_back(field);
    solids.emplace_back(Shape(BallShape{-1}));
    RandomPairs random(15);
    pairs = random.pairs(count);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t turn = i / (solids.size() + 1);
      pairs[i].a = static_cast<std::uint32_t>(i % (solids.size() + 1));
      pairs[i].scale_b *= random.uniform(0.1, 0.5);
      if (turn % 10 == 9) pairs[i].b = pairs[i].a;
      if (turn % 3 == 0) {
        std::swap(pairs[i].a, pairs[i].b);
        std::swap(pairs[i].pose_a, pairs[i].pose_b);
        std::swap(pairs[i].scale_a, pairs[i].scale_b);
      }
    }
  }
};

TEST_F(GpuQueryTest, FieldsHaveTheBitsOfAWarpOnTheHost) {
  MixedScene scene(400);
  scene.pairs[21].pose_b.t[0] = std::nan("");
  scene.pairs[31].scale_b = -1;
  scene.pairs[41].b = 1000;
  const GpuSolids solids(scene.solids);
  GpuWorkspace workspace(scene.pairs.size());
  const Stream stream;
  for (const Measure measure : {Measure::matched, Measure::inner}) {
    const DeviceBatch batch(scene.pairs);
    penetration_batch(solids, batch.pairs(), {measure}, workspace, batch.answers(), stream);
    stream.wait();
    HostBatch host(scene.solids);
    host.cut_for(scene.pairs.size());
    expect_same_bits(batch.get(), host.run(scene.pairs, measure, 1));
  }
}

/// Asks for some pairs, then for `count` among which they come again and again; both have the same
/// answers, which it returns.
std::vector<Penetration> ask_for_few_and_many(const std::vector<GpuSolid>& all,
                                              const std::vector<BatchPair>& some,
                                              std::size_t count) {
  std::vector<BatchPair> pairs;
  for (std::size_t i = 0; i < count; ++i) pairs.push_back(some[(i * 7919) % some.size()]);
  const GpuSolids solids(all);
  GpuWorkspace workspace(pairs.size());
  const Stream stream;
  const DeviceBatch few(some), many(pairs);
  penetration_batch(solids, few.pairs(), {}, workspace, few.answers(), stream);
  penetration_batch(solids, many.pairs(), {}, workspace, many.answers(), stream);
  stream.wait();
  std::vector<Penetration> expected = few.get(), repeated;
  for (std::size_t i = 0; i < count; ++i) repeated.push_back(expected[(i * 7919) % some.size()]);
  expect_same_bits(many.get(), repeated);
  return expected;
}

TEST_F(GpuQueryTest, ManyPairsInFieldsHaveTheSameBitsInEveryRun) {
  const MixedScene scene(3000);
  ask_for_few_and_many(scene.solids, scene.pairs, 300000);
}

/// More pairs than fit into a round, and some that fit into none.
TEST_F(GpuQueryTest, LargePairsAmongTrianglesHaveTheSameBitsHoweverManyThereAre) {
  const MixedScene scene(500);
  std::vector<BatchPair> some;
  for (BatchPair pair : scene.pairs) {
    const auto* const field =
        pair.a < scene.solids.size() ? std::get_if<Shape>(&scene.solids[pair.a]) : nullptr;
    if (field == nullptr || pair.b >= batch_assets().size() ||
        !(std::holds_alternative<HeightFieldShape>(*field) ||
          std::holds_alternative<BoxShape>(*field)))
      continue;
    pair.pose_b = pair.pose_a;
    pair.scale_b = 2 * pair.scale_a;
    some.push_back(pair);
  }
  ASSERT_GE(some.size(), 15u);
  HostBatch host(scene.solids);
  expect_same_bits(ask_for_few_and_many(scene.solids, some, 60000),
                   host.run(some, Measure::matched, 1));
}

TEST_F(GpuQueryTest, BudgetsAndCopiesHaveTheBitsOfAWarpOnTheHost) {
  std::vector<BatchPair> pairs = detailed_pairs(60, 16);
  for (const BatchPair& copy : copies_in_place(30, 17)) pairs.push_back(copy);
  const GpuSolids solids(detailed_solids());
  GpuWorkspace workspace(pairs.size());
  const Stream stream;
  for (const std::uint32_t budget : {0u, 50u, 2000u}) {
    const DeviceBatch batch(pairs);
    penetration_batch(solids, batch.pairs(), {Measure::matched, budget}, workspace, batch.answers(),
                      stream);
    stream.wait();
    HostBatch host(detailed_solids());
    expect_same_bits(batch.get(), host.run(pairs, Measure::matched, 1, budget));
  }
}

TEST_F(GpuQueryTest, ManyPairsHaveTheSameBitsInEveryRun) {
  const std::vector<BatchPair> some = RandomPairs(12).pairs(3000);
  std::vector<BatchPair> pairs;
  for (std::size_t i = 0; i < 300000; ++i) pairs.push_back(some[(i * 7919) % some.size()]);
  const GpuSolids solids(batch_solids());
  GpuWorkspace workspace(pairs.size());
  const Stream stream;
  const DeviceBatch few(some), many(pairs);
  penetration_batch(solids, few.pairs(), {Measure::matched}, workspace, few.answers(), stream);
  penetration_batch(solids, many.pairs(), {Measure::matched}, workspace, many.answers(), stream);
  stream.wait();
  const std::vector<Penetration> expected = few.get();
  std::vector<Penetration> repeated;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    repeated.push_back(expected[(i * 7919) % some.size()]);
  expect_same_bits(many.get(), repeated);
}

/// Answers of one of a few pairs each: only compared members are kept.
class RepeatedPairs {
 public:
  RepeatedPairs(const std::vector<BatchPair>& some, std::size_t size)
      : size_(size),
        of_(some.size()),
        a_(column<std::uint32_t>(some, [](const auto& p) { return p.a; })),
        b_(column<std::uint32_t>(some, [](const auto& p) { return p.b; })),
        pose_a_(column<Pose>(some, [](const auto& p) { return p.pose_a; })),
        pose_b_(column<Pose>(some, [](const auto& p) { return p.pose_b; })),
        scale_a_(column<double>(some, [](const auto& p) { return p.scale_a; })),
        scale_b_(column<double>(some, [](const auto& p) { return p.scale_b; })) {}

  GpuPairs pairs() const {
    return {size_,
            {a_.data(), pose_a_.data(), scale_a_.data()},
            {b_.data(), pose_b_.data(), scale_b_.data()}};
  }
  /// The pair that the i-th is.
  std::size_t which(std::size_t i) const { return (i * 7919) % of_; }

 private:
  template <class T, class Get>
  std::vector<T> column(const std::vector<BatchPair>& some, const Get& get) const {
    std::vector<T> out;
    out.reserve(size_);
    for (std::size_t i = 0; i < size_; ++i) out.push_back(get(some[which(i)]));
    return out;
  }

  std::size_t size_, of_;
  OnDevice<std::uint32_t> a_, b_;
  OnDevice<Pose> pose_a_, pose_b_;
  OnDevice<double> scale_a_, scale_b_;
};

TEST_F(GpuQueryTest, BatchesOfOneAndOfTenMillionAreAnsweredAsOfFew) {
  const std::vector<BatchPair> some = RandomPairs(18).pairs_at_all_distances(3000);
  const GpuSolids solids(batch_solids());
  const Stream stream;
  const auto ask = [&](const RepeatedPairs& of, std::size_t most_pairs) {
    const std::size_t n = of.pairs().count;
    GpuWorkspace workspace(most_pairs);
    const OnDevice<double> volume(n), distance(n), of_patch(n);
    const OnDevice<QueryStatus> status(n);
    const OnDevice<std::uint32_t> patches(n);
    GpuPenetrations overlaps;
    overlaps.volume = volume.data();
    overlaps.status = status.data();
    GpuSeparations gaps;
    gaps.distance = distance.data();
    GpuContactPatches one;
    one.most = 1;
    one.count = patches.data();
    one.volume = of_patch.data();
    penetration_batch(solids, of.pairs(), {Measure::matched}, workspace, overlaps, stream);
    separation_batch(solids, of.pairs(), {}, workspace, gaps, stream);
    contact_patches_batch(solids, of.pairs(), Measure::matched, workspace, {}, one, stream);
    stream.wait();
    struct Answers {
      std::vector<double> volume, distance, of_patch;
      std::vector<QueryStatus> status;
      std::vector<std::uint32_t> patches;
    };
    return Answers{volume.get(), distance.get(), of_patch.get(), status.get(), patches.get()};
  };
  // A workspace for few cuts pairs up finer than one for many: the bits of a kind are the same.
  const RepeatedPairs few(some, some.size());
  const auto finely = ask(few, some.size()), coarsely = ask(few, kFewGpuPairs + 1);
  for (std::size_t i = 0; i < some.size(); ++i)
    EXPECT_NEAR(finely.volume[i], coarsely.volume[i], 1e-6 * coarsely.volume[i]) << i;
  std::vector<std::size_t> place(some.size());
  for (std::size_t i = 0; i < some.size(); ++i) place[few.which(i)] = i;
  for (const std::size_t count : {std::size_t{1}, std::size_t{10'000'000}}) {
    const RepeatedPairs all(some, count);
    const auto answers = ask(all, count);
    const auto& expected = count > some.size() ? coarsely : finely;
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t k = place[all.which(i)];
      wrong += answers.volume[i] != expected.volume[k] ||
               answers.distance[i] != expected.distance[k] ||
               answers.status[i] != QueryStatus::ok || answers.patches[i] != expected.patches[k] ||
               (answers.patches[i] > 0 && answers.of_patch[i] != expected.of_patch[k]);
    }
    EXPECT_EQ(wrong, 0u) << count;
  }
}

TEST_F(GpuQueryTest, AGraphMayCaptureIt) {
  const std::vector<BatchPair> pairs = RandomPairs(13).pairs(500);
  const GpuSolids solids(batch_solids());
  GpuWorkspace workspace(pairs.size());
  const Stream stream;
  const DeviceBatch direct(pairs), captured(pairs);
  penetration_batch(solids, direct.pairs(), {Measure::matched}, workspace, direct.answers(),
                    stream);
  stream.wait();
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t ready = nullptr;
  gpu::check(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal), "capturing");
  penetration_batch(solids, captured.pairs(), {Measure::matched}, workspace, captured.answers(),
                    stream);
  gpu::check(cudaStreamEndCapture(stream, &graph), "capturing");
  gpu::check(cudaGraphInstantiate(&ready, graph, 0), "making a graph");
  for (int k = 0; k < 3; ++k) gpu::check(cudaGraphLaunch(ready, stream), "launching a graph");
  stream.wait();
  expect_same_bits(captured.get(), direct.get());
  cudaGraphExecDestroy(ready);
  cudaGraphDestroy(graph);
}

TEST_F(GpuQueryTest, WhatDoesNotFitIsAnError) {
  const std::vector<BatchPair> pairs = RandomPairs(14).pairs(5);
  const GpuSolids solids(batch_solids());
  GpuWorkspace workspace(4);
  const DeviceBatch batch(pairs);
  EXPECT_THROW(penetration_batch(solids, batch.pairs(), {Measure::matched}, workspace,
                                 batch.answers(), nullptr),
               Error);
  const GpuSolid none = AssetView{};
  constexpr auto kNameless = static_cast<Measure>(3);
  EXPECT_THROW(penetration_batch(solids, GpuPairs{}, {kNameless}, workspace, {}, nullptr), Error);
  EXPECT_THROW(contact_patches_batch(solids, GpuPairs{}, kNameless, workspace, {}, {}, nullptr),
               Error);
  EXPECT_THROW(GpuSolids({&none, 1}), Error);
  EXPECT_THROW(GpuWorkspace(std::size_t{1} << 40), Error);
  const GpuSolid function = Shape(FunctionShape{});
  EXPECT_THROW(GpuSolids({&function, 1}), Error);
  EXPECT_EQ(GpuSolids({}).size(), 0u);
  const DeviceBatch empty({});
  penetration_batch(solids, empty.pairs(), {Measure::matched}, workspace, empty.answers(), nullptr);
}

}  // namespace
}  // namespace ist::testing
