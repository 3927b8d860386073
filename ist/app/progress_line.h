#pragma once

#include <ist/types.h>

#include "app/interrupt.h"
#include "library/whole_progress.h"

namespace ist::app {

inline constexpr const char* kWipe = "\r\033[K";  ///< a line on a terminal

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

/// Returns work(callback) with a ProgressCallback that shows the line and stops at Ctrl-C.
/// `patience` [s]: see InterruptGuard; `quiet`, `rounds`: see ProgressLine. Throws ExitCode 130
/// after Ctrl-C, whatever the result of the work.
template <class Work>
auto interruptibly(double patience, bool quiet, bool rounds, const Work& work) {
  const InterruptGuard guard(patience);
  ProgressLine line(quiet, rounds);
  try {
    auto made = work([&line](const Progress& progress) {
      line.show(progress);
      return !interrupted();
    });
    exit_if_interrupted();
    return made;
  } catch (const Error&) {
    exit_if_interrupted();
    throw;
  }
}

}  // namespace ist::app
