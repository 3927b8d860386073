#include <algorithm>
#include <atomic>
#include <limits>

#include <ist/query.h>

namespace ist {
namespace {

// Pairs that a worker takes at a time: enough that the counter is not what it waits for.
constexpr std::size_t kTaken = 4;

struct Batch {
  std::span<const PlacedPair> pairs;
  const PenetrationSettings& settings;
  std::span<Workspace> workspaces;
  std::span<Penetration> answers;
  std::atomic<std::size_t> next = 0;
};

/// Answers pairs as long as there are any. Which worker answers a pair changes nothing of it.
void work(void* context, std::size_t worker) {
  Batch& batch = *static_cast<Batch*>(context);
  const std::size_t count = batch.pairs.size();
  for (;;) {
    const std::size_t begin = batch.next.fetch_add(kTaken, std::memory_order_relaxed);
    if (begin >= count) return;
    for (std::size_t i = begin; i < std::min(begin + kTaken, count); ++i)
      batch.answers[i] =
          penetration(batch.pairs[i].a, batch.pairs[i].b, batch.settings, batch.workspaces[worker]);
  }
}

}  // namespace

void penetration_batch(std::span<const PlacedPair> pairs, const PenetrationSettings& settings,
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
  Batch batch{pairs.first(count), settings, workspaces, answers};
  if (parallel.run == nullptr) {
    work(&batch, 0);
  } else if (count > 0) {
    parallel.run(parallel.pool, std::min(workspaces.size(), count), work, &batch);
  }
}

}  // namespace ist
