#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/lenses.h>
#include <ist/query.h>
#include <ist/query_tbb.h>
#include <ist/shapes.h>

#include <cmath>
#include <limits>
#include <thread>

#include "support/random_assets.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

using testing::make_random_asset;
using testing::random_pose;

class PenetrationBatch : public ::testing::Test {
 protected:
  PenetrationBatch() {
    std::mt19937_64 random(3);
    for (int i = 0; i < 203; ++i) {
      const PlacedAsset a{assets_[i % 3].view(), random_pose(random, 0.2), 1.0};
      PlacedAsset b{assets_[i % 2].view(), random_pose(random, 0.01 * i), i % 5 == 0 ? 0.1 : 1.0};
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
      if (one.status == QueryStatus::invalid_input) {
        ASSERT_EQ(answers[i].status, one.status) << "pair " << i;
        ASSERT_TRUE(std::isnan(answers[i].volume) && std::isnan(one.volume)) << "pair " << i;
        continue;
      }
      ASSERT_EQ(answers[i].volume, one.volume) << "pair " << i;
      ASSERT_EQ(answers[i].volume_min, one.volume_min);
      ASSERT_EQ(answers[i].volume_max, one.volume_max);
      ASSERT_EQ(answers[i].centroid, one.centroid);
      ASSERT_EQ(answers[i].force, one.force);
      ASSERT_EQ(answers[i].torque, one.torque);
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

/// Patches too are those of single queries, each pair's where they belong.
TEST_F(PenetrationBatch, Patches) {
  std::vector<Workspace> scratch;
  for (int i = 0; i < 3; ++i) scratch.emplace_back(1 << 16);
  constexpr std::size_t kEach = 5;
  const auto expect_same_patches = [&](const auto& pairs) {
    for (const ParallelFor& parallel : {ParallelFor{}, tbb_parallel_for()}) {
      std::vector<ContactPatches> answers(pairs.size());
      std::vector<ContactPatch> patches(kEach * pairs.size() + 3);
      contact_patches_batch(pairs, {}, scratch, answers, patches, parallel);
      std::size_t met = 0;
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        std::vector<ContactPatch> own(kEach);
        const ContactPatches one = contact_patches(pairs[i].a, pairs[i].b, {}, scratch[0], own);
        ASSERT_EQ(answers[i].count, one.count) << "pair " << i;
        ASSERT_EQ(answers[i].penetration.status, one.penetration.status);
        if (one.penetration.status == QueryStatus::invalid_input) continue;
        ASSERT_EQ(answers[i].penetration.volume, one.penetration.volume);
        for (std::size_t k = 0; k < one.count; ++k) {
          const ContactPatch& found = patches[kEach * i + k];
          ASSERT_EQ(found.id, own[k].id);
          ASSERT_EQ(found.volume, own[k].volume);
          ASSERT_EQ(found.force, own[k].force);
          ASSERT_EQ(found.torque, own[k].torque);
        }
        met += one.count > 0;
      }
      EXPECT_GT(met, pairs.size() / 2);
    }
  };
  expect_same_patches(std::span<const PlacedPair>(pairs_));
  std::vector<PlacedPair> fields;
  for (const PlacedPair& pair : pairs_)
    fields.push_back({{BallShape{0.8}, std::get<PlacedAsset>(pair.a.placed).pose}, pair.b});
  expect_same_patches(std::span<const PlacedPair>(fields));

  std::vector<ContactPatches> answers(3);
  contact_patches_batch(pairs_, {}, {}, answers, {});
  EXPECT_EQ(answers[2].penetration.status, QueryStatus::budget_exhausted);
  EXPECT_EQ(answers[2].count, 0u);
  contact_patches_batch(std::span<const PlacedPair>(), {}, scratch, answers, {});
  contact_patches_batch(pairs_, {}, scratch, answers, {});
  EXPECT_EQ(answers[2].penetration.status, QueryStatus::invalid_input);
}

TEST_F(PenetrationBatch, OnTheCallingThread) { expect_same({}, 1); }

/// A thread for each worker; their number goes to `started`.
ParallelFor on_threads(std::size_t* started = nullptr) {
  ParallelFor threads;
  threads.pool = started;
  threads.run = [](void* pool, std::size_t workers, void (*work)(void*, std::size_t), void* batch) {
    if (pool != nullptr) *static_cast<std::size_t*>(pool) = workers;
    std::vector<std::thread> all;
    for (std::size_t i = 0; i < workers; ++i) all.emplace_back(work, batch, i);
    for (std::thread& thread : all) thread.join();
  };
  return threads;
}

TEST_F(PenetrationBatch, OnThreadsOfTheCaller) {
  std::size_t started = 0;
  const ParallelFor threads = on_threads(&started);
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

// Meshes: the same bits on many threads, and NaN where one is not held.
TEST_F(PenetrationBatch, Exact) {
  const Asset cube = bake_mesh_only(close_mesh(testing::cube_mesh(), "cube"));
  const Asset ball = bake_mesh_only(close_mesh(testing::icosphere_mesh(4), "ball"));
  std::size_t met = 0;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    if (i == 50) continue;  // holds spheres alone
    std::get<PlacedAsset>(pairs_[i].a.placed).asset = (i % 2 == 0 ? cube : ball).view();
    std::get<PlacedAsset>(pairs_[i].b.placed).asset = (i % 3 == 0 ? cube : ball).view();
  }
  std::vector<Workspace> scratch;
  for (int i = 0; i < 8; ++i) scratch.emplace_back();
  const PenetrationSettings exact{.measure = Measure::exact};
  std::vector<Penetration> answers(pairs_.size());
  penetration_batch(pairs_, exact, scratch, answers, on_threads());
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const Penetration one = penetration(pairs_[i].a, pairs_[i].b, exact, scratch[0]);
    ASSERT_EQ(answers[i].status, one.status) << "pair " << i;
    if (i == 50) {
      EXPECT_EQ(one.status, QueryStatus::missing_data);
      EXPECT_TRUE(std::isnan(answers[i].volume));
      continue;
    }
    ASSERT_EQ(one.status, i == 77 ? QueryStatus::invalid_input : QueryStatus::ok);
    if (i == 77) {
      EXPECT_TRUE(std::isnan(answers[i].volume));
      continue;
    }
    ASSERT_EQ(answers[i].volume, one.volume);
    ASSERT_EQ(answers[i].volume_min, one.volume_min);
    ASSERT_EQ(answers[i].volume_max, one.volume_max);
    ASSERT_EQ(answers[i].centroid, one.centroid);
    ASSERT_EQ(answers[i].force, one.force);
    ASSERT_EQ(answers[i].torque, one.torque);
    ASSERT_EQ(answers[i].node_visits, one.node_visits);
    met += one.volume > 0;
  }
  EXPECT_GT(met, pairs_.size() / 2);
}

// A field has no mesh: nobody takes that for no contact.
TEST_F(PenetrationBatch, ExactOfAFieldIsNotHeld) {
  const Asset cube = bake_mesh_only(close_mesh(testing::cube_mesh(), "cube"));
  std::vector<Workspace> scratch(1);
  const PlacedPair pairs[] = {{{BallShape{0.8}, {}}, {cube.view(), {}, 1}}};
  Penetration answers[1];
  penetration_batch(pairs, {.measure = Measure::exact}, scratch, answers);
  for (const Penetration& answer : answers) {
    EXPECT_EQ(answer.status, QueryStatus::missing_data);
    EXPECT_TRUE(std::isnan(answer.volume) && answer.force.hasNaN());
  }
  ContactPatch patches[2];
  const ContactPatches found =
      contact_patches(pairs[0].a, pairs_[0].b, {.measure = Measure::exact}, scratch[0], patches);
  EXPECT_EQ(found.penetration.status, QueryStatus::missing_data);
  EXPECT_EQ(found.count, 0u);
  const auto& tree = std::get<PlacedAsset>(pairs_[0].b.placed);
  EXPECT_EQ(overlap_lenses(tree, tree, {.measure = Measure::exact}, {}).status,
            QueryStatus::invalid_input);
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
  penetration_batch(std::span<const PlacedPair>(), {}, scratch, answers, tbb_parallel_for());
}

}  // namespace
}  // namespace ist
