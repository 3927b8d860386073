#pragma once

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/concurrent_vector.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_reduce.h>
#include <oneapi/tbb/task_arena.h>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <type_traits>
#include <utility>
#include <vector>

namespace ist {

/// An arena for a stage's threads: `threads` of them (0 = all cores), but no more than TBB allows,
/// since it would warn on stderr.
inline oneapi::tbb::task_arena thread_arena(unsigned threads) {
  const std::size_t allowed = oneapi::tbb::global_control::active_value(
      oneapi::tbb::global_control::max_allowed_parallelism);
  const std::size_t used = threads == 0 ? allowed : std::min<std::size_t>(threads, allowed);
  return oneapi::tbb::task_arena(static_cast<int>(used));
}

/// Calls work(i) for i in [from, to) on the current arena's threads, `grain` or more at a time.
template <class Work>
void for_each_index(std::size_t from, std::size_t to, std::size_t grain, const Work& work) {
  oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(from, to, grain),
                            [&](const oneapi::tbb::blocked_range<std::size_t>& range) {
                              for (std::size_t i = range.begin(); i != range.end(); ++i) work(i);
                            });
}

/// The number of i in [0, count) for which is_so(i).
template <class IsSo>
std::size_t count_where(std::size_t count, const IsSo& is_so) {
  return oneapi::tbb::parallel_reduce(
      oneapi::tbb::blocked_range<std::size_t>(0, count), std::size_t{0},
      [&](const oneapi::tbb::blocked_range<std::size_t>& range, std::size_t so) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) so += is_so(i) ? 1 : 0;
        return so;
      },
      std::plus<>());
}

/// The few i in [0, count) for which is_so(i).
template <class IsSo>
std::vector<std::uint32_t> indices_where(std::size_t count, const IsSo& is_so) {
  oneapi::tbb::concurrent_vector<std::uint32_t> found;
  oneapi::tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    if (is_so(i)) found.push_back(static_cast<std::uint32_t>(i));
  });
  std::vector<std::uint32_t> sorted(found.begin(), found.end());
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

/// Runs work on a new thread, whose loops use `threads` threads. The future waits for it.
template <class Work>
std::future<std::invoke_result_t<Work>> do_aside(unsigned threads, Work work) {
  return std::async(std::launch::async, [threads, work = std::move(work)] {
    return thread_arena(threads).execute(work);
  });
}

/// Calls `meanwhile` twenty times a second until a result is available.
template <class Future, class Meanwhile>
void wait_for(const Future& future, const Meanwhile& meanwhile) {
  while (future.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) meanwhile();
}

/// Stops work on other threads: their loops check it, and end by throwing WorkStop::Stopped.
class WorkStop {
 public:
  struct Stopped {};

  void stop() noexcept { stopped_.store(true, std::memory_order_relaxed); }
  bool stopped() const noexcept { return stopped_.load(std::memory_order_relaxed); }
  /// Throws Stopped after stop() was called.
  void look() const {
    if (stopped()) throw Stopped();
  }

 private:
  std::atomic<bool> stopped_ = false;
};

/// A part of a bake that runs once in the background. Its destructor stops unfinished work and
/// waits for it.
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

  /// Starts the work unless it has started; calls `meanwhile` twenty times a second. Throws what
  /// the work throws.
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
