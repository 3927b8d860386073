#pragma once

#include <atomic>
#include <chrono>

namespace ist {

/// Ends work on other threads: loops look at it, and are left by a WorkStop::Stopped.
class WorkStop {
 public:
  struct Stopped {};

  /// `time_limit` [s] from now; 0: none.
  explicit WorkStop(double time_limit = 0)
      : timed_(time_limit > 0),
        end_(Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                std::chrono::duration<double>(timed_ ? time_limit : 0))) {}

  void stop() noexcept { stopped_.store(true, std::memory_order_relaxed); }

  /// Whether stop() was called or the time is over.
  bool stopped() const noexcept {
    return stopped_.load(std::memory_order_relaxed) || (timed_ && Clock::now() >= end_);
  }
  /// Throws Stopped then.
  void look() const {
    if (stopped()) throw Stopped();
  }

 private:
  using Clock = std::chrono::steady_clock;
  std::atomic<bool> stopped_ = false;
  const bool timed_;
  const Clock::time_point end_;
};

}  // namespace ist
