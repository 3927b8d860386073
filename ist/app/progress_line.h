#pragma once

#include <ist/progress.h>

#include "library/whole_progress.h"

namespace ist::app {

/// One line on stderr that is written over and over, where stderr is a terminal; nothing elsewhere.
class ProgressLine {
 public:
  /// `rounds`: see WholeProgress.
  explicit ProgressLine(bool quiet, bool rounds = false);
  ~ProgressLine();  ///< wipes the line
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(const Progress& progress);

 private:
  bool active_;
  WholeProgress whole_;
};

}  // namespace ist::app
