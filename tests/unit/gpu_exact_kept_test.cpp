#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "support/exact_batches.h"

// Data that exact batches of the GPU keep from call to call: their source run by teams of the host
// (gpu_exact_test.cpp).

namespace ist::testing {
namespace {

/// Calls a batch that keeps and one that does not, whose bits must be the same but for the counts
/// of nodes.
class Beside {
 public:
  Beside(const std::vector<Asset>& assets, std::size_t pairs, std::uint32_t bytes_each = 1 << 15)
      : kept(views_of(assets)), scratch_(views_of(assets)) {
    kept.keep(static_cast<std::uint32_t>(pairs), bytes_each);
  }
  void ask(const std::vector<BatchPair>& pairs, unsigned seed = 0) {
    std::vector<Penetration> expected = scratch_.run(pairs, Measure::exact, seed),
                             found = kept.run(pairs, Measure::exact, seed);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      EXPECT_TRUE(found[i].node_visits == 0 || found[i].node_visits == expected[i].node_visits);
      found[i].node_visits = expected[i].node_visits = 0;
      met += found[i].volume > 0;
      touching += found[i].touching;
    }
    expect_same_bits(found, expected);
    held += kept.held;
    fresh += kept.fresh;
  }

  HostBatch kept;
  std::size_t held = 0, fresh = 0, met = 0, touching = 0;

 private:
  HostBatch scratch_;
};

/// Moves and turns a pair by so much of its size.
void move(RandomPairs& random, double by, BatchPair& pair) {
  Pose& pose = pair.pose_b;
  for (double& t : pose.t) t += by * random.uniform(-1, 1);
  for (double& q : pose.q) q += by * random.uniform(-1, 1);
}

/// Steps of all sizes, jumps, pairs in each other's place, and back.
void ask_motion(Beside& both, std::vector<BatchPair> pairs, int steps, unsigned seed = 0) {
  RandomPairs random(51);
  const std::vector<BatchPair> first = pairs;
  for (int step = 0; step < steps; ++step) {
    both.ask(pairs, seed == 0 ? 0 : seed + static_cast<unsigned>(step));
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double by = std::pow(10.0, -2 - static_cast<double>(i % 5));
      if (i % 7 != 0) move(random, i % 11 == 0 ? 0.1 : by, pairs[i]);
      if (i % 13 == 5 && step % 4 == 3) pairs[i] = first[i];
    }
    if (step % 5 == 4) std::swap(pairs[0], pairs[pairs.size() / 2]);
  }
}

TEST(GpuExactKept, StepsHaveTheBitsOfASearch) {
  std::vector<BatchPair> pairs = exact_pairs(61, 60);
  for (const BatchPair& pair : aligned_pairs(62, 40)) pairs.push_back(pair);
  Beside both(exact_assets(), pairs.size());
  ask_motion(both, pairs, 16);
  EXPECT_GT(both.held, 320u);
  EXPECT_GT(both.fresh, 40u);
  EXPECT_GT(both.met, 400u);
}

/// A straight motion reaches the end of each margin: pairs that were not kept would be missed.
TEST(GpuExactKept, MarginsHoldToTheirEnds) {
  RandomPairs random(69);
  std::vector<BatchPair> pairs;
  std::vector<Pose> speed;
  for (std::uint32_t i = 0; i < 80; ++i) {
    BatchPair pair = {i % 2, i / 2 % 2, random.pose(0.2), random.pose(0.8), 1, 1};
    pair.scale_b = std::exp(random.uniform(-0.7, 0.3));
    pairs.push_back(pair);
    // The one moves, the next turns.
    Pose step = {{0, 0, 0, 0}, {0, 0, 0}};
    for (int k = 0; k < 3; ++k) (i % 3 == 0 ? step.t[k] : step.q[k + 1]) = random.uniform(-1, 1);
    speed.push_back(step);
  }
  Beside both(exact_assets(), pairs.size());
  for (int step = 0; step < 14; ++step) {
    both.ask(pairs);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      for (int k = 0; k < 3; ++k) pairs[i].pose_b.t[k] += 3e-3 * speed[i].t[k];
      for (int k = 1; k < 4; ++k) pairs[i].pose_b.q[k] += 2e-3 * speed[i].q[k];
    }
  }
  EXPECT_GT(both.held, 400u);
  EXPECT_GT(both.fresh, 80u);
  EXPECT_GT(both.met, 600u);
}

/// Results must not depend on which lane does what, and when.
TEST(GpuExactKept, LanesOfAWarpNeedNoLuck) {
  std::vector<BatchPair> pairs = exact_pairs(63, 12);
  for (const BatchPair& pair : aligned_pairs(64, 8)) pairs.push_back(pair);
  Beside both(exact_assets(), pairs.size());
  ask_motion(both, pairs, 6, 1);
  EXPECT_GT(both.held, 20u);
}

/// Faces on each other, which slide, part and come back.
TEST(GpuExactKept, MatesSlideAsFound) {
  const MatedBatch mated(65, 60);
  Beside both(mated.assets, mated.pairs.size());
  std::vector<BatchPair> pairs = mated.pairs;
  for (int step = 0; step < 10; ++step) {
    both.ask(pairs);
    for (std::size_t i = 0; i < pairs.size(); ++i)
      pairs[i].pose_b.t[i % 3] +=
          (step % 2 == 0 ? 1 : -1) * std::ldexp(1.0, -8 - 6 * static_cast<int>(i % 4));
  }
  EXPECT_GT(both.held, 500u);
  EXPECT_GT(both.touching, 300u);
}

/// A long solid whose ends move far as the small one beside its middle turns.
TEST(GpuExactKept, SmallSolidsTurnBesideLargeOnes) {
  std::vector<BatchPair> pairs;
  for (BatchPair pair : exact_pairs(66, 100)) {
    pair.pose_a = {{1, 0, 0, 0}, {0, 0, 0}};
    pair.scale_a = 1;
    pair.scale_b = 0.03;
    const double up = 1 + 0.02 * static_cast<double>(pairs.size() % 3);
    for (double& t : pair.pose_b.t) t *= up / 2;
    pairs.push_back(pair);
    std::swap(pair.a, pair.b);
    std::swap(pair.pose_a, pair.pose_b);
    std::swap(pair.scale_a, pair.scale_b);
    pairs.push_back(pair);
  }
  Beside both(exact_assets(), pairs.size());
  RandomPairs random(67);
  for (int step = 0; step < 12; ++step) {
    both.ask(pairs);
    for (BatchPair& pair : pairs)
      for (double& q : pair.pose_b.q) q += 1e-3 * random.uniform(-1, 1);
  }
  EXPECT_GT(both.held, 500u);
}

/// Pairs without memory are searched in each call.
TEST(GpuExactKept, LittleMemoryDoesNotShow) {
  const std::vector<BatchPair> pairs = exact_pairs(68, 100);
  Beside both(exact_assets(), pairs.size(), 1024);
  both.kept.mesh_capacity = 7;
  both.kept.mesh_chunks = 12;
  ask_motion(both, pairs, 8);
  EXPECT_GT(both.held, 50u);
  EXPECT_LT(both.held, 400u);
}

}  // namespace
}  // namespace ist::testing
