#include "library/job_queue.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace ist {

JobQueue::JobQueue(std::vector<std::uint64_t> needs, std::uint64_t memory)
    : needs_(std::move(needs)), memory_(memory), waiting_(needs_.size()) {
  // From the back, so that jobs of one size are handed out in their order.
  std::iota(waiting_.rbegin(), waiting_.rend(), std::size_t{0});
  std::stable_sort(waiting_.begin(), waiting_.end(),
                   [&](std::size_t a, std::size_t b) { return needs_[a] < needs_[b]; });
}

std::optional<std::size_t> JobQueue::take() {
  std::unique_lock lock(mutex_);
  for (;;) {
    if (waiting_.empty()) return std::nullopt;
    const std::uint64_t left = memory_ - std::min(used_, memory_);
    auto best = waiting_.end();
    if (running_ != 0)
      best =
          std::upper_bound(waiting_.begin(), waiting_.end(), left,
                           [&](std::uint64_t room, std::size_t job) { return room < needs_[job]; });
    if (best != waiting_.begin()) {
      const std::size_t job = *--best;
      waiting_.erase(best);
      used_ += needs_[job];
      ++running_;
      return job;
    }
    changed_.wait(lock);
  }
}

void JobQueue::give_back(std::size_t job) {
  const std::lock_guard lock(mutex_);
  used_ -= needs_[job];
  --running_;
  changed_.notify_all();
}

void JobQueue::close() {
  const std::lock_guard lock(mutex_);
  waiting_.clear();
  changed_.notify_all();
}

std::size_t JobQueue::waiting() {
  const std::lock_guard lock(mutex_);
  return waiting_.size();
}

}  // namespace ist
