#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <ist/query.h>

namespace ist {

struct DescentLimits {
  static constexpr std::uint32_t kNoLimit = ~0u;

  std::uint32_t max_visits = kNoLimit;  ///< 0: only the roots are tested
  bool keep_rounding = false;           ///< grazing lenses are not summed again in double

  void spend(std::uint32_t visits) noexcept {
    if (max_visits != kNoLimit) max_visits -= std::min(max_visits, visits);
  }
};

inline std::uint32_t visit_limit(std::uint32_t max_visits) noexcept {
  return max_visits != 0 ? max_visits : DescentLimits::kNoLimit;
}

template <class Settings>
DescentLimits limits_of(const Settings& settings) noexcept {
  return {visit_limit(settings.max_visits), false};
}

/// Counts visits up to a limit.
class Budget {
 public:
  explicit Budget(std::uint32_t most) noexcept : most_(most) {}

  /// Returns how many of the next `wanted` visits are within the limit, and counts them.
  std::size_t grant(std::size_t wanted) noexcept {
    const std::size_t granted = std::min<std::size_t>(wanted, left());
    visits_ += static_cast<std::uint32_t>(granted);
    return granted;
  }

  bool limited() const noexcept { return most_ != DescentLimits::kNoLimit; }
  std::uint32_t left() const noexcept { return most_ - visits_; }
  std::uint32_t visits() const noexcept { return visits_; }

 private:
  std::uint32_t most_;
  std::uint32_t visits_ = 0;
};

}  // namespace ist
