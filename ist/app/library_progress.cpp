#include "app/library_progress.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "app/interrupt.h"
#include "library/text.h"

namespace ist::app {
namespace {

constexpr const char* kWipe = "\r\033[K";
constexpr double kWindow = 30;  // [s] over which the rate is taken

double seconds(std::chrono::steady_clock::duration time) {
  return std::chrono::duration<double>(time).count();
}

/// "45 s", "3 min 20 s", "2 h 5 min".
std::string in_words(double time) {
  const auto s = static_cast<std::uint64_t>(std::ceil(time));
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{} min {} s", s / 60, s % 60);
  return fmt::format("{} h {} min", s / 3600, s % 3600 / 60);
}

}  // namespace

LibraryProgress::LibraryProgress(std::size_t jobs, bool quiet)
    : jobs_(jobs), quiet_(quiet), line_(!quiet && isatty(STDERR_FILENO) == 1) {}

void LibraryProgress::finished(const JobResult& result) {
  ++done_;
  cached_ += result.status == JobStatus::cached ? 1 : 0;
  ends_.push_back(Clock::now());
  if (line_) fmt::print(stderr, "{}", kWipe);
  std::fflush(stderr);
  const std::string place = fmt::format("[{}/{}] {}", done_, jobs_, result.name);
  if (result.status == JobStatus::failed) {
    ++failed_;
    spdlog::error("{}: failed: {}", place, result.message);
  } else {
    if (!line_)
      spdlog::info("{}: {} in {:.2f} s, {} spheres, {:.1f} %", place, name_of(result.status),
                   result.seconds, grouped(result.spheres), 100 * result.coverage);
    for (const std::string& warning : result.warnings) spdlog::warn("{}: {}", place, warning);
  }
}

double LibraryProgress::rate() {
  const Clock::time_point now = Clock::now();
  while (!ends_.empty() && seconds(now - ends_.front()) > kWindow) ends_.pop_front();
  const double window = std::min(seconds(now - start_), kWindow);
  return window > 0 ? static_cast<double>(ends_.size()) / window : 0;
}

void LibraryProgress::wait_a_little() {
  if (!line_) return;
  const double now = rate();
  std::string left;
  if (now > 0)
    left = fmt::format("  {:.3g} a second  {} left", now,
                       in_words(static_cast<double>(jobs_ - done_) / now));
  fmt::print(stderr, "{}{} of {} assets  {} cached  {} failed{}  {}", kWipe, grouped(done_),
             grouped(jobs_), grouped(cached_), grouped(failed_), left,
             interrupted() ? "stopping" : in_words(seconds(Clock::now() - start_)));
  std::fflush(stderr);
}

bool LibraryProgress::stop() { return interrupted(); }

void LibraryProgress::end() {
  if (line_) fmt::print(stderr, "{}", kWipe);
}

}  // namespace ist::app
