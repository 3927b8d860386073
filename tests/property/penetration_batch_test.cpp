#include <gtest/gtest.h>
#include <ist/query.h>
#include <ist/query_tbb.h>

#include <limits>
#include <thread>

#include "support/random_assets.h"

namespace ist {
namespace {

using testing::make_random_asset;
using testing::random_pose;

class PenetrationBatch : public ::testing::Test {
 protected:
  PenetrationBatch() {
    std::mt19937_64 random(3);
    for (int i = 0; i < 203; ++i) {
      const PlacedTree a{assets_[i % 3].view(), random_pose(random, 0.2), 1.0};
      PlacedTree b{assets_[i % 2].view(), random_pose(random, 0.01 * i), i % 5 == 0 ? 0.1 : 1.0};
      if (i == 77) b.pose.t[0] = std::numeric_limits<double>::quiet_NaN();
      pairs_.push_back({a, b});
    }
  }

  /// The batch's answers are those of single queries, bit for bit.
  void expect_same(const ParallelFor& parallel, std::size_t workspaces,
                   const PenetrationSettings& settings = {}) {
    std::vector<Workspace> scratch;
    for (std::size_t i = 0; i < workspaces; ++i) scratch.emplace_back(1 << 16);
    std::vector<Penetration> answers(pairs_.size());
    answers[5].volume = -1;
    penetration_batch(pairs_, settings, scratch, answers, parallel);
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const Penetration one = penetration(pairs_[i].a, pairs_[i].b, settings, scratch[0]);
      ASSERT_EQ(answers[i].volume, one.volume) << "pair " << i;
      ASSERT_EQ(answers[i].volume_min, one.volume_min);
      ASSERT_EQ(answers[i].volume_max, one.volume_max);
      ASSERT_EQ(answers[i].centroid, one.centroid);
      ASSERT_EQ(answers[i].translation_gradient, one.translation_gradient);
      ASSERT_EQ(answers[i].rotation_gradient, one.rotation_gradient);
      ASSERT_EQ(answers[i].status, one.status);
      ASSERT_EQ(answers[i].node_visits, one.node_visits);
      ASSERT_EQ(answers[i].sphere_pairs, one.sphere_pairs);
    }
  }

  const Asset assets_[3] = {make_random_asset({700, 0.2, {}, 0}, 1),
                            make_random_asset({300, 0.1, {}, 0}, 2),
                            make_random_asset({60, 0.5, {}, 0}, 3)};
  std::vector<PlacedPair> pairs_;
};

TEST_F(PenetrationBatch, OnTheCallingThread) { expect_same({}, 1); }

TEST_F(PenetrationBatch, OnThreadsOfTheCaller) {
  std::size_t started = 0;
  ParallelFor threads;
  threads.pool = &started;
  threads.run = [](void* pool, std::size_t workers, void (*work)(void*, std::size_t), void* batch) {
    *static_cast<std::size_t*>(pool) = workers;
    std::vector<std::thread> all;
    for (std::size_t i = 0; i < workers; ++i) all.emplace_back(work, batch, i);
    for (std::thread& thread : all) thread.join();
  };
  expect_same(threads, 4);
  EXPECT_EQ(started, 4u);
  PenetrationSettings stopped;
  stopped.max_visits = 30;
  expect_same(threads, 3, stopped);
}

TEST_F(PenetrationBatch, OnAPoolThatRunsWorkersOneByOneAndBackwards) {
  ParallelFor serial;
  serial.run = [](void*, std::size_t workers, void (*work)(void*, std::size_t), void* batch) {
    while (workers > 0) work(batch, --workers);
  };
  expect_same(serial, 5);
}

TEST_F(PenetrationBatch, OnTbb) { expect_same(tbb_parallel_for(), 4); }

TEST_F(PenetrationBatch, AnswersNoMoreThanThereIsRoomFor) {
  std::vector<Workspace> scratch;
  std::vector<Penetration> answers(3);
  penetration_batch(pairs_, {}, scratch, answers);
  for (const Penetration& answer : answers) {  // no workspace: nothing is known
    EXPECT_EQ(answer.status, QueryStatus::budget_exhausted);
    EXPECT_EQ(answer.volume_max, std::numeric_limits<double>::infinity());
  }
  scratch.emplace_back();
  penetration_batch(pairs_, {}, scratch, answers);
  for (std::size_t i = 0; i < answers.size(); ++i)
    EXPECT_EQ(answers[i].volume, penetration(pairs_[i].a, pairs_[i].b, {}, scratch[0]).volume);
  penetration_batch({}, {}, scratch, answers, tbb_parallel_for());
}

}  // namespace
}  // namespace ist
