#include "library/job_queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <optional>
#include <random>
#include <thread>

namespace ist {
namespace {

TEST(JobQueue, HandsOutTheLargestThatFits) {
  JobQueue queue({10, 50, 30, 50, 1}, 60);
  EXPECT_EQ(queue.take(), 1u);  // of equal ones the first
  EXPECT_EQ(queue.take(), 0u);  // 50, 30 would be too much
  queue.give_back(1);
  EXPECT_EQ(queue.take(), 3u);
  queue.give_back(0);
  EXPECT_EQ(queue.take(), 4u);
  queue.give_back(3);
  EXPECT_EQ(queue.waiting(), 1u);
  EXPECT_EQ(queue.take(), 2u);
  EXPECT_EQ(queue.take(), std::nullopt);
}

TEST(JobQueue, WhatIsLargerThanAllRunsAlone) {
  JobQueue queue({1000, 5, 2000}, 60);
  EXPECT_EQ(queue.take(), 2u);
  std::atomic<int> taken = 0;
  std::thread other([&] { taken = queue.take() == 0u ? 1 : -1; });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(taken, 0);
  queue.give_back(2);
  other.join();
  EXPECT_EQ(taken, 1);
  queue.close();
  EXPECT_EQ(queue.take(), std::nullopt);
}

/// Many threads: every job once, never more memory than there is but by one job alone.
TEST(JobQueue, KeepsToTheMemory) {
  std::mt19937 random(1);
  std::vector<std::uint64_t> needs(500);
  for (std::uint64_t& need : needs) need = random() % 50 == 0 ? 1000 : 1 + random() % 60;
  JobQueue queue(needs, 100);
  std::atomic<std::uint64_t> used = 0;
  std::atomic<int> running = 0, wrong = 0;
  std::vector<std::atomic<int>> times(needs.size());
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i)
    threads.emplace_back([&] {
      while (const auto job = queue.take()) {
        ++times[*job];
        const std::uint64_t now = used += needs[*job];
        if (++running > 1 && now > 100) ++wrong;
        std::this_thread::yield();
        --running;
        used -= needs[*job];
        queue.give_back(*job);
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
  for (const std::atomic<int>& count : times) EXPECT_EQ(count, 1);
}

TEST(GpuPlaces, AreSpreadOverTheGpus) {
  EXPECT_EQ(GpuPlaces(0, 2).places(), 0u);
  GpuPlaces places(2, 2);
  EXPECT_EQ(places.places(), 4u);
  const GpuPlaces::Place a(places), b(places);
  EXPECT_NE(a.gpu(), b.gpu());
  const GpuPlaces::Place c(places);
  std::optional<GpuPlaces::Place> d(std::in_place, places);
  EXPECT_NE(c.gpu(), d->gpu());
  // All are taken: the next one waits.
  std::atomic<bool> waited = false, taken = false;
  std::thread other([&] {
    const GpuPlaces::Place e(places);
    taken = true;
    EXPECT_TRUE(waited);
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_FALSE(taken);
  waited = true;
  d->hold(false);
  other.join();
  d->hold(true);
}

TEST(Memory, IsThereAndJobsTakeSome) {
  EXPECT_GT(available_memory(), std::uint64_t{1} << 20);
  Job small, large;
  small.settings.packing.max_spheres = 10;
  large.settings.packing.max_spheres = 0;
  EXPECT_GT(memory_of(large), 4 * memory_of(small));
}

}  // namespace
}  // namespace ist
