#pragma once

#include <algorithm>
#include <atomic>
#include <limits>

#include <ist/query.h>

namespace ist {

/// Calls answer(i, worker) for each i in [0, count), on at most `workers` > 0 workers.
template <class Answer>
void answer_all(std::size_t count, std::size_t workers, const ParallelFor& parallel,
                const Answer& answer) noexcept {
  struct Batch {
    std::size_t count;
    const Answer& answer;
    std::atomic<std::size_t> next = 0;
  } all{count, answer};
  const auto work = [](void* context, std::size_t worker) {
    constexpr std::size_t kTaken = 4;  // per fetch, to limit contention on the counter
    Batch& batch = *static_cast<Batch*>(context);
    for (;;) {
      const std::size_t begin = batch.next.fetch_add(kTaken, std::memory_order_relaxed);
      if (begin >= batch.count) return;
      for (std::size_t i = begin; i < std::min(begin + kTaken, batch.count); ++i)
        batch.answer(i, worker);
    }
  };
  if (parallel.run == nullptr) {
    work(&all, 0);
  } else if (count > 0) {
    parallel.run(parallel.pool, std::min(workers, count), work, &all);
  }
}

/// The answers of a batch without workspaces.
inline Penetration unknown_penetration() noexcept {
  Penetration unknown;
  unknown.volume_max = std::numeric_limits<double>::infinity();
  unknown.status = QueryStatus::budget_exhausted;
  return unknown;
}
inline Separation unknown_separation() noexcept {
  Separation unknown;
  unknown.distance = unknown.distance_max = std::numeric_limits<double>::infinity();
  unknown.status = QueryStatus::budget_exhausted;
  return unknown;
}

}  // namespace ist
