#pragma once

#include <ist/progress.h>

namespace ist::app {

/// One line on stderr that is written over and over, where stderr is a terminal; nothing elsewhere.
class ProgressLine {
 public:
  explicit ProgressLine(bool quiet);
  ~ProgressLine();  ///< wipes the line
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(const Progress& progress);

 private:
  bool active_;
};

}  // namespace ist::app
