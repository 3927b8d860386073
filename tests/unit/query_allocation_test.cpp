#include <gtest/gtest.h>
#include <ist/query.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "support/random_assets.h"

// Every way to the heap counts while a query runs. Sanitizers bring their own malloc.
namespace {
std::atomic<long> heap_calls{0};
}  // namespace

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
extern "C" {
void* __libc_malloc(std::size_t);
void __libc_free(void*);
void* malloc(std::size_t n) {
  heap_calls.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(n);
}
void free(void* p) {
  heap_calls.fetch_add(1, std::memory_order_relaxed);
  __libc_free(p);
}
}
#define IST_HEAP_IS_COUNTED 1
#endif

namespace ist {
namespace {

TEST(Query, NeverTouchesTheHeap) {
#ifndef IST_HEAP_IS_COUNTED
  GTEST_SKIP() << "the sanitizer owns malloc";
#endif
  const Asset a = testing::make_random_asset({600, 0.2, {}, 0}, 1);
  const Asset b = testing::make_random_asset({600, 0.2, {}, 0}, 2);
  Workspace workspace;
  std::mt19937_64 random(4);
  const long before_control = heap_calls.load();
  delete new int(7);
  std::free(std::malloc(8));
  ASSERT_GT(heap_calls.load(), before_control) << "the hook does not count";

  for (int i = 0; i < 40; ++i) {
    QuerySettings settings;
    if (i % 4 == 1) settings.max_visits = 40;
    if (i % 4 == 2) settings.relative_error = 0.1;
    if (i % 4 == 3) settings.deadline_us = 5;
    const PlacedTree pa{a.view(), testing::random_pose(random, 0.0), 1.0};
    const PlacedTree pb{b.view(), testing::random_pose(random, 0.06 * i), i % 3 == 0 ? 0.01 : 1.0};
    const long before = heap_calls.load();
    const PenetrationAndSeparation answer = query(pa, pb, settings, workspace);
    const long after = heap_calls.load();
    EXPECT_EQ(after, before);
    EXPECT_NE(answer.penetration.status, QueryStatus::invalid_pose);
  }
}

}  // namespace
}  // namespace ist
