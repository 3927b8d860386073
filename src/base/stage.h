#pragma once

#include <ist/types.h>
#include <chrono>
#include <optional>
#include <utility>

namespace ist {

/// An offline stage's clock and its word with whoever looks on: what it reports, and whether it may
/// go on. One a stage, for one thread at a time.
class Stage {
 public:
  /// `name`: Progress::stage. `time_limit` [s]: 0 = none.
  Stage(const char* name, ProgressCallback progress, double time_limit = 0)
      : name_(name), progress_(std::move(progress)), time_limit_(time_limit) {}

  double elapsed() const;  ///< [s] since the stage was made
  bool watched() const {
    return progress_ || time_limit_ > 0;
  }  ///< a callback or a time limit is set

  /// Reports a step of a stage that cannot be cut short. Throws Error if the callback cancels.
  void step(std::size_t spheres, double fraction);

  /// Why a stage that may be cut short is to stop now, if it is. Asks the callback at once, for the
  /// stage before may not have for a while, and then ten times a second at most; `fill(progress)`
  /// then says where the stage stands.
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

  bool due();                 ///< somebody looks on, and has not been told for a tenth of a second
  bool report(Progress now);  ///< false: cancelled

  const char* const name_;
  const ProgressCallback progress_;
  const double time_limit_;
  const Clock::time_point start_ = Clock::now();
  std::optional<Clock::time_point> last_report_;
};

}  // namespace ist
