#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <vector>

// How late a loop gets its answers, and what makes it late.

/// Computes and walks through more memory than caches hold, until told to stop.
inline void burden(const std::atomic<bool>& stop) {
  std::vector<std::uint32_t> memory(1 << 24);
  std::uint32_t at = 1;
  while (!stop.load(std::memory_order_relaxed))
    for (int i = 0; i < 4096; ++i) {
      at = at * 1664525 + 1013904223;
      memory[at >> 8] += at;
    }
}

inline double clock_us(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}
inline double now_us() { return clock_us(CLOCK_MONOTONIC); }

inline void sleep_until(double us) {
  timespec t{};
  t.tv_sec = static_cast<time_t>(us / 1e6);
  t.tv_nsec = static_cast<long>(1e3 * (us - 1e6 * static_cast<double>(t.tv_sec)));
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) != 0) {
  }
}

/// Forces that came after the next tick was due, by what is to blame.
struct Missed {
  std::size_t work = 0;         ///< the tick itself ran for longer than a period
  std::size_t timer = 0;        ///< the loop was woken late; the tick then took less than a period
  std::size_t interrupted = 0;  ///< in time by its own work, but something else ran in its midst

  std::size_t all() const { return work + timer + interrupted; }

  /// [µs] `computed`: time this thread ran for the tick; `taken`: from being woken to the force.
  void count(double computed, double taken, double period) {
    ++(computed > period ? work : taken > period ? interrupted : timer);
  }
};

struct Quantiles {
  double p50, p99, p999, max;
};

inline Quantiles quantiles(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto at = [&](double p) {
    return values[static_cast<std::size_t>(p * static_cast<double>(values.size() - 1) + 0.5)];
  };
  return {at(0.5), at(0.99), at(0.999), values.back()};
}
