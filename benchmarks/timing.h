#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <ctime>
#include <vector>

namespace ist::benchmark {

/// [s] wall clock, monotonic.
inline double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// [s] time this thread has run: other programs on the machine do not count.
inline double thread_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// [s] time all threads of this process have run.
inline double process_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Nearest-rank quantile, 0 ≤ p ≤ 1; 0 of nothing.
inline double quantile(std::vector<double> values, double p) {
  if (values.empty()) return 0;
  const std::size_t rank =
      static_cast<std::size_t>(p * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(rank),
                   values.end());
  return values[rank];
}

/// [s] what reading the clock twice costs by itself.
inline double clock_cost() {
  std::vector<double> costs;
  for (int i = 0; i < 1001; ++i) {
    const double start = thread_seconds();
    costs.push_back(thread_seconds() - start);
  }
  return quantile(costs, 0.5);
}

}  // namespace ist::benchmark
