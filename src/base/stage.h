#pragma once

#include <ist/types.h>
#include <chrono>
#include <optional>
#include <utility>

namespace ist {

/// The clock, progress reports and cancellation of an offline stage. One per stage, for one thread
/// at a time.
class Stage {
 public:
  /// `name`: Progress::stage. `time_limit` [s]: 0 = none.
  Stage(const char* name, ProgressCallback progress, double time_limit = 0)
      : name_(name), progress_(std::move(progress)), time_limit_(time_limit) {}

  double elapsed() const;  ///< [s] since construction
  bool watched() const {
    return progress_ || time_limit_ > 0;
  }  ///< a callback or a time limit is set

  /// Reports a step of a stage that cannot stop early. Throws Error if the callback cancels.
  void step(std::size_t spheres, double fraction);

  /// Returns why a stage must stop now, if it must. Calls the callback at once the first time,
  /// since the previous stage may not have for a while, and then at most ten times a second;
  /// `fill(progress)` provides the stage's progress.
  template <class Fill>
  std::optional<StopReason> stop(const Fill& fill) {
    const bool late = time_limit_ > 0 && elapsed() >= time_limit_;
    if (due()) {
      Progress now;
      fill(now);
      if (!report(now)) return StopReason::cancelled;
    }
    if (late) return StopReason::time_limit;
    return std::nullopt;
  }

 private:
  using Clock = std::chrono::steady_clock;

  bool due();                 ///< there is a callback, not called for a tenth of a second
  bool report(Progress now);  ///< false: cancelled

  const char* const name_;
  const ProgressCallback progress_;
  const double time_limit_;
  const Clock::time_point start_ = Clock::now();
  std::optional<Clock::time_point> last_report_;
};

}  // namespace ist
