#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <string>

#include "library/run_jobs.h"

namespace ist::app {

/// On a terminal one line on stderr that is written over and over, with rate and time left, and
/// what failed above it; elsewhere a line an asset.
class LibraryProgress final : public RunObserver {
 public:
  LibraryProgress(std::size_t jobs, bool quiet);

  void finished(const JobResult& result) override;
  void wait_a_little() override;
  bool stop() override;
  void end();  ///< wipes the line

 private:
  using Clock = std::chrono::steady_clock;
  double rate();  ///< [1/s] of the last half minute; 0: nothing ended

  const std::size_t jobs_;
  const bool quiet_, line_;
  const Clock::time_point start_ = Clock::now();
  std::size_t done_ = 0, cached_ = 0, failed_ = 0;
  std::deque<Clock::time_point> ends_;  ///< of the last half minute
};

}  // namespace ist::app
