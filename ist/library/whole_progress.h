#pragma once

#include <ist/types.h>

namespace ist {

/// The overall progress of a call with several stages.
class WholeProgress {
 public:
  /// `rounds`: the stages repeat an unknown number of times, as in bake_to_error().
  explicit WholeProgress(bool rounds) : rounds_(rounds) {}

  /// [0, 1] of the call's time, an estimate that never falls.
  double share(const Progress& progress);

 private:
  const bool rounds_;
  int stage_ = 0;
  double begin_ = 0, rest_ = 1;  ///< the share at which this round began, and the remaining share
  double share_ = 0;
};

}  // namespace ist
