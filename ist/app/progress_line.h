#pragma once

#include <fmt/format.h>
#include <unistd.h>
#include <cstdio>
#include <string_view>

#include "app/interrupt.h"
#include "library/whole_progress.h"

namespace ist::app {

inline constexpr const char* kWipe = "\r\033[K";  ///< a line on a terminal

/// One line on stderr that is continually updated if stderr is a terminal; nothing otherwise.
class ProgressLine {
 public:
  /// `rounds`: see WholeProgress.
  explicit ProgressLine(bool quiet, bool rounds = false)
      : active_(!quiet && isatty(STDERR_FILENO) == 1), whole_(rounds) {}
  ~ProgressLine() {
    if (active_) fmt::print(stderr, "{}", kWipe);
  }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(const Progress& progress) {
    if (!active_) return;
    std::string packed;  // the other stages have neither
    if (std::string_view(progress.stage) == "pack")
      packed = fmt::format("coverage {:.2f} %  radius {:.3g}  ", 100 * progress.coverage,
                           progress.radius);
    fmt::print(stderr, "{}{:3.0f} %  {:<9} {} spheres  {}{:.1f} s", kWipe,
               100 * whole_.share(progress), progress.stage, progress.spheres, packed,
               progress.elapsed);
    std::fflush(stderr);
  }

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
