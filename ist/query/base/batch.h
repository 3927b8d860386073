#pragma once

#include <algorithm>
#include <atomic>
#include <limits>
#include <span>

#include <ist/query.h>

namespace ist {

/// Answers pairs of any kind, each with penetration(), on the workers of a pool.
template <class Pair>
class Batch {
 public:
  Batch(std::span<const Pair> pairs, const PenetrationSettings& settings,
        std::span<Workspace> workspaces, std::span<Penetration> answers) noexcept
      : pairs_(pairs), settings_(settings), workspaces_(workspaces), answers_(answers) {}

  /// Answers pairs as long as there are any. Which worker answers a pair changes nothing of it.
  static void work(void* context, std::size_t worker) {
    Batch& batch = *static_cast<Batch*>(context);
    const std::size_t count = batch.pairs_.size();
    for (;;) {
      const std::size_t begin = batch.next_.fetch_add(kTaken, std::memory_order_relaxed);
      if (begin >= count) return;
      for (std::size_t i = begin; i < std::min(begin + kTaken, count); ++i)
        batch.answers_[i] = penetration(batch.pairs_[i].a, batch.pairs_[i].b, batch.settings_,
                                        batch.workspaces_[worker]);
    }
  }

 private:
  // Pairs that a worker takes at a time: enough that the counter is not what it waits for.
  static constexpr std::size_t kTaken = 4;

  std::span<const Pair> pairs_;
  const PenetrationSettings& settings_;
  std::span<Workspace> workspaces_;
  std::span<Penetration> answers_;
  std::atomic<std::size_t> next_ = 0;
};

template <class Pair>
void answer_batch(std::span<const Pair> pairs, const PenetrationSettings& settings,
                  std::span<Workspace> workspaces, std::span<Penetration> answers,
                  const ParallelFor& parallel) noexcept {
  const std::size_t count = std::min(pairs.size(), answers.size());
  if (workspaces.empty()) {
    Penetration unknown;
    unknown.volume_max = std::numeric_limits<double>::infinity();
    unknown.status = QueryStatus::budget_exhausted;
    std::fill_n(answers.begin(), count, unknown);
    return;
  }
  Batch<Pair> batch(pairs.first(count), settings, workspaces, answers);
  if (parallel.run == nullptr) {
    Batch<Pair>::work(&batch, 0);
  } else if (count > 0) {
    parallel.run(parallel.pool, std::min(workspaces.size(), count), Batch<Pair>::work, &batch);
  }
}

}  // namespace ist
