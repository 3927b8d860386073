#pragma once

#include <algorithm>
#include <atomic>
#include <limits>
#include <span>

#include <ist/query.h>

namespace ist {

/// Answers `count` pairs of any kind on the workers of a pool: answer(i, workspace) is called once
/// for each. Which worker does it changes nothing of the answer.
template <class Answer>
class Batch {
 public:
  Batch(std::size_t count, std::span<Workspace> workspaces, const Answer& answer) noexcept
      : count_(count), workspaces_(workspaces), answer_(answer) {}

  void run(const ParallelFor& parallel) noexcept {
    if (parallel.run == nullptr) {
      work(this, 0);
    } else if (count_ > 0) {
      parallel.run(parallel.pool, std::min(workspaces_.size(), count_), work, this);
    }
  }

 private:
  // Pairs that a worker takes at a time: enough that the counter is not what it waits for.
  static constexpr std::size_t kTaken = 4;

  /// Answers pairs as long as there are any.
  static void work(void* context, std::size_t worker) {
    Batch& batch = *static_cast<Batch*>(context);
    for (;;) {
      const std::size_t begin = batch.next_.fetch_add(kTaken, std::memory_order_relaxed);
      if (begin >= batch.count_) return;
      for (std::size_t i = begin; i < std::min(begin + kTaken, batch.count_); ++i)
        batch.answer_(i, batch.workspaces_[worker]);
    }
  }

  const std::size_t count_;
  std::span<Workspace> workspaces_;
  const Answer& answer_;
  std::atomic<std::size_t> next_ = 0;
};

/// What is known of a pair that no workspace is there for.
inline Penetration unanswered() noexcept {
  Penetration unknown;
  unknown.volume_max = std::numeric_limits<double>::infinity();
  unknown.status = QueryStatus::budget_exhausted;
  return unknown;
}

template <class Pair>
void answer_batch(std::span<const Pair> pairs, const PenetrationSettings& settings,
                  std::span<Workspace> workspaces, std::span<Penetration> answers,
                  const ParallelFor& parallel) noexcept {
  const std::size_t count = std::min(pairs.size(), answers.size());
  if (workspaces.empty()) {
    std::fill_n(answers.begin(), count, unanswered());
    return;
  }
  const auto answer = [&](std::size_t i, Workspace& workspace) {
    answers[i] = penetration(pairs[i].a, pairs[i].b, settings, workspace);
  };
  Batch(count, workspaces, answer).run(parallel);
}

/// Each pair has as many patches as the next, in the order of pairs.
template <class Pair>
void patch_batch(std::span<const Pair> pairs, const ContactSettings& settings,
                 std::span<Workspace> workspaces, std::span<ContactPatches> answers,
                 std::span<ContactPatch> patches, const ParallelFor& parallel) noexcept {
  const std::size_t count = std::min(pairs.size(), answers.size());
  if (count == 0) return;
  if (workspaces.empty()) {
    std::fill_n(answers.begin(), count, ContactPatches{unanswered(), 0});
    return;
  }
  const std::size_t each = patches.size() / count;
  const auto answer = [&](std::size_t i, Workspace& workspace) {
    answers[i] = contact_patches(pairs[i].a, pairs[i].b, settings, workspace,
                                 patches.subspan(i * each, each));
  };
  Batch(count, workspaces, answer).run(parallel);
}

}  // namespace ist
