#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <cstddef>

#include "stage/work_stop.h"

namespace ist {

/// Work that another thread watches and may end.
class WatchedWork : public WorkStop {
 public:
  /// Calls each(i) for all i < count on the caller's TBB threads: `share` of all work. Throws
  /// Stopped soon after stop() was called.
  template <class Each>
  void for_each(std::size_t count, double share, const Each& each) {
    constexpr std::size_t kTold = 64;  // at a time: threads that write the same place wait
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count), [&](const auto& range) {
      for (std::size_t i = range.begin(), from = i; i < range.end(); ++i) {
        look();
        each(i);
        if (i + 1 - from < kTold && i + 1 < range.end()) continue;
        done_.fetch_add(share * static_cast<double>(i + 1 - from) / static_cast<double>(count),
                        std::memory_order_relaxed);
        from = i + 1;
      }
    });
  }

  double done() const { return done_.load(std::memory_order_relaxed); }  ///< the sum of shares

 private:
  std::atomic<double> done_ = 0;
};

}  // namespace ist
