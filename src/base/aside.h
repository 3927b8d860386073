#pragma once

#include <atomic>
#include <functional>
#include <future>
#include <utility>

#include "base/thread_arena.h"

namespace ist {

/// Ends work on other threads: loops look at it, and are left by a WorkStop::Stopped.
class WorkStop {
 public:
  struct Stopped {};

  void stop() noexcept { stopped_.store(true, std::memory_order_relaxed); }
  bool stopped() const noexcept { return stopped_.load(std::memory_order_relaxed); }
  /// Throws Stopped once stop() was called.
  void look() const {
    if (stopped()) throw Stopped();
  }

 private:
  std::atomic<bool> stopped_ = false;
};

/// A part of a bake that is done once, on threads of its own. Where the scope is left before its
/// end, it is stopped and waited for.
template <class Result>
class Aside {
 public:
  /// `threads`: 0 = all cores.
  Aside(unsigned threads, std::function<Result(const WorkStop&)> work)
      : threads_(threads), work_(std::move(work)) {}
  ~Aside() { stop_.stop(); }
  Aside(const Aside&) = delete;
  Aside& operator=(const Aside&) = delete;

  void start() {
    if (!made_.valid()) made_ = do_aside(threads_, [this] { return work_(stop_); }).share();
  }

  /// Starts it if nobody has; calls `meanwhile` twenty times a second. Throws what the work throws.
  Result wait(const std::function<void()>& meanwhile) {
    start();
    wait_for(made_, meanwhile);
    return made_.get();
  }

 private:
  const unsigned threads_;
  const std::function<Result(const WorkStop&)> work_;
  WorkStop stop_;
  std::shared_future<Result> made_;  ///< last: waits for the thread
};

}  // namespace ist
