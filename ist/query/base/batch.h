#pragma once

#include <algorithm>
#include <atomic>
#include <limits>

#include <ist/query.h>

namespace ist {

/// Items that the workers of a pool answer, by answer(i, worker).
template <class Answer>
class Batch {
 public:
  Batch(std::size_t count, const Answer& answer) noexcept : count_(count), answer_(answer) {}

  /// Answers items until none is left. No answer depends on the worker that gives it.
  static void work(void* context, std::size_t worker) {
    Batch& batch = *static_cast<Batch*>(context);
    for (;;) {
      const std::size_t begin = batch.next_.fetch_add(kTaken, std::memory_order_relaxed);
      if (begin >= batch.count_) return;
      for (std::size_t i = begin; i < std::min(begin + kTaken, batch.count_); ++i)
        batch.answer_(i, worker);
    }
  }

 private:
  // Items that a worker takes at a time, so that workers do not wait for the counter.
  static constexpr std::size_t kTaken = 4;

  std::size_t count_;
  const Answer& answer_;
  std::atomic<std::size_t> next_ = 0;
};

/// Calls answer(i, worker) for each i in [0, count), on at most `workers` > 0 workers.
template <class Answer>
void answer_all(std::size_t count, std::size_t workers, const ParallelFor& parallel,
                const Answer& answer) noexcept {
  Batch<Answer> batch(count, answer);
  if (parallel.run == nullptr) {
    Batch<Answer>::work(&batch, 0);
  } else if (count > 0) {
    parallel.run(parallel.pool, std::min(workers, count), Batch<Answer>::work, &batch);
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
