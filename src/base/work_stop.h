#pragma once

#include <atomic>

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

}  // namespace ist
