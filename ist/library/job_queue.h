#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

namespace ist {

/// Hands out jobs, the largest first, as memory allows. For many threads.
class JobQueue {
 public:
  /// `needs` [bytes] of each job; `memory` [bytes] of all that run at once.
  JobQueue(std::vector<std::uint64_t> needs, std::uint64_t memory);

  /// The largest of those that fit beside what runs, or the largest of all where nothing runs.
  /// Waits for others to end where none fits. Nothing: there are no more.
  std::optional<std::size_t> take();

  void give_back(std::size_t job);  ///< what take() gave, once it has ended
  void close();                     ///< no more are handed out
  std::size_t waiting();            ///< jobs not taken yet

 private:
  const std::vector<std::uint64_t> needs_;
  const std::uint64_t memory_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::size_t> waiting_;  ///< the smallest first
  std::uint64_t used_ = 0;
  std::size_t running_ = 0;
};

}  // namespace ist
