#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include <ist/query.h>

namespace ist {

/// Where a descent ends early; 0 = no limit.
struct DescentLimits {
  std::uint32_t max_visits = 0;
  double deadline_us = 0;  ///< [µs] from now
  double relative_error = 0;
  double min_radius = 0;  ///< [u]
  double shares = 0;      ///< of the leaves (descent/shares.h), at most; 0: as many as time allows
  bool keep_rounding = false;  ///< lenses that graze are not summed again in double
};

/// [µs] A deadline that is over before anything is looked at.
inline constexpr double kOver = 1e-6;

/// The limits that a query's settings set; a separation has fewer.
template <class Settings>
DescentLimits limits_of(const Settings& settings) noexcept {
  return {settings.max_visits,
          settings.deadline_us,
          settings.relative_error,
          settings.min_radius,
          0,
          false};
}
inline DescentLimits limits_of(const SeparationSettings& settings) noexcept {
  return {settings.max_visits, settings.deadline_us, 0, 0, 0, false};
}

/// The time since a query began; read only if there is a deadline.
class Stopwatch {
 public:
  explicit Stopwatch(const DescentLimits& limits) noexcept {
    if (limits.deadline_us > 0) start_ = Clock::now();
  }

  /// What is left of the limits' deadline: one that is over, if nothing is.
  double left_of(const DescentLimits& limits) const noexcept {
    if (!(limits.deadline_us > 0)) return 0;
    const std::chrono::duration<double, std::micro> gone = Clock::now() - start_;
    return std::max(kOver, limits.deadline_us - gone.count());
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_;
};

/// Counts visits and watches the clock, if there is a deadline: at most once in 16 visits. Visits
/// end at a part of the time, what is left being for a guess of what was not visited. Time for
/// which the system takes the thread away is not counted, three times at most.
class Budget {
 public:
  /// `for_visits`: the part of the time that visits may take.
  explicit Budget(const DescentLimits& limits, double for_visits = 0.6) noexcept
      : for_visits_(for_visits),
        max_visits_(limits.max_visits != 0 ? limits.max_visits : ~0u),
        timed_(limits.deadline_us > 0) {
    if (timed_) {
      start_ = last_look_ = Clock::now();
      allowed_ = std::chrono::duration<double>(std::max(limits.deadline_us, kOver) * 1e-6);
      if (limits.deadline_us <= kOver) {  // however slow the clock, and whoever had the thread
        start_ -= std::chrono::seconds(1);
        stalls_ = kMostStalls;
      }
    }
  }

  /// How many of the next `wanted` visits may be made; they count as made.
  std::size_t grant(std::size_t wanted) noexcept {
    const std::size_t granted = std::min<std::size_t>(wanted, left());
    if (granted == 0) return 0;
    if (timed_ && visits_ >= next_look_) {
      if (visits_end()) return 0;
      next_look_ = visits_ + 16;
    }
    visits_ += static_cast<std::uint32_t>(granted);
    return granted;
  }

  /// Counts visits that are made whatever the time; there must be so many left.
  std::size_t take(std::size_t visits) noexcept {
    visits_ += static_cast<std::uint32_t>(visits);
    return visits;
  }

  /// Whether visits are to end now.
  bool visits_end() noexcept { return elapsed_beyond(for_visits_); }

  /// Whether such a part of the time is over; never without a deadline.
  bool elapsed_beyond(double part) noexcept { return timed_ && elapsed() >= part; }

  /// The part of the time that is over; only with a deadline.
  double elapsed() noexcept {
    const Clock::time_point now = Clock::now();
    if (now - last_look_ > kStall && stalls_ < kMostStalls) {
      ++stalls_;
      start_ += now - last_look_;
    }
    last_look_ = now;
    return std::chrono::duration<double>(now - start_) / allowed_;
  }

  /// Visits may go on up to another part of the time.
  void extend(double for_visits) noexcept { for_visits_ = for_visits; }

  bool timed() const noexcept { return timed_; }

  /// Takes back visits that were granted and not made.
  void give_back(std::size_t visits) noexcept { visits_ -= static_cast<std::uint32_t>(visits); }

  std::uint32_t left() const noexcept { return max_visits_ - visits_; }
  std::uint32_t visits() const noexcept { return visits_; }

 private:
  using Clock = std::chrono::steady_clock;
  // Work between two looks takes a few microseconds: for longer the system had the thread away. The
  // answer is late then whatever is done, and a poor one besides would be felt as a jolt.
  static constexpr std::chrono::microseconds kStall{8};
  static constexpr int kMostStalls = 3;

  double for_visits_;
  std::uint32_t max_visits_;
  std::uint32_t visits_ = 0;
  std::uint32_t next_look_ = 0;
  bool timed_;
  int stalls_ = 0;
  Clock::time_point start_, last_look_;
  std::chrono::duration<double> allowed_{0};
};

}  // namespace ist
