#include "app/progress_line.h"

#include <fmt/format.h>
#include <unistd.h>
#include <cstdio>
#include <string>
#include <string_view>

namespace ist::app {

ProgressLine::ProgressLine(bool quiet, bool rounds)
    : active_(!quiet && isatty(STDERR_FILENO) == 1), whole_(rounds) {}

ProgressLine::~ProgressLine() {
  if (active_) fmt::print(stderr, "{}", kWipe);
}

void ProgressLine::show(const Progress& progress) {
  if (!active_) return;
  std::string packed;  // the other stages know neither
  if (std::string_view(progress.stage) == "pack")
    packed =
        fmt::format("coverage {:.2f} %  radius {:.3g}  ", 100 * progress.coverage, progress.radius);
  fmt::print(stderr, "{}{:3.0f} %  {:<9} {} spheres  {}{:.1f} s", kWipe,
             100 * whole_.share(progress), progress.stage, progress.spheres, packed,
             progress.elapsed);
  std::fflush(stderr);
}

}  // namespace ist::app
