#pragma once

#include <ist/types.h>

namespace ist {

/// Where a call of several stages stands as a whole.
class WholeProgress {
 public:
  /// `rounds`: stages begin again, nobody knows how often, as those of bake_to_error().
  explicit WholeProgress(bool rounds) : rounds_(rounds) {}

  /// [0, 1] of the call's time, an estimate that never falls.
  double share(const Progress& progress);

 private:
  const bool rounds_;
  int stage_ = 0;
  double begin_ = 0, rest_ = 1;  ///< where this round began, and what it is a part of
  double share_ = 0;
};

}  // namespace ist
