#pragma once

#include <tbb/parallel_for.h>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

namespace ist {

/// Union–find whose representatives are the smallest members. unite() and find() may be called from
/// many threads at once; the result is that of a single thread.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t size)
      : parent_(std::make_unique_for_overwrite<std::uint32_t[]>(size)) {
    tbb::parallel_for(std::size_t{0}, size,
                      [&](std::size_t i) { parent_[i] = static_cast<std::uint32_t>(i); });
  }

  std::uint32_t find(std::uint32_t i) {
    for (std::uint32_t above = parent(i).load(std::memory_order_relaxed); above != i;) {
      const std::uint32_t next = parent(above).load(std::memory_order_relaxed);
      // Path halving. A parent's index only decreases, within the same set.
      if (next != above) parent(i).compare_exchange_weak(above, next, std::memory_order_relaxed);
      i = above = next;
      above = parent(i).load(std::memory_order_relaxed);
    }
    return i;
  }

  void unite(std::uint32_t a, std::uint32_t b) {
    for (;;) {
      a = find(a);
      b = find(b);
      if (a == b) return;
      if (a > b) std::swap(a, b);
      std::uint32_t root = b;
      if (parent(b).compare_exchange_strong(root, a, std::memory_order_relaxed)) return;
    }
  }

 private:
  std::atomic_ref<std::uint32_t> parent(std::uint32_t i) {
    return std::atomic_ref<std::uint32_t>(parent_[i]);
  }

  std::unique_ptr<std::uint32_t[]> parent_;
};

}  // namespace ist
