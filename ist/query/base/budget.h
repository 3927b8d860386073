#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <ist/query.h>

namespace ist {

/// Where a descent ends early.
struct DescentLimits {
  static constexpr std::uint32_t kNoLimit = ~0u;

  std::uint32_t max_visits = kNoLimit;  ///< 0: nothing but the roots is tested
  bool keep_rounding = false;           ///< lenses that graze are not summed again in double

  /// Takes visits that were made off.
  void spend(std::uint32_t visits) noexcept {
    if (max_visits != kNoLimit) max_visits -= std::min(max_visits, visits);
  }
};

inline std::uint32_t visit_limit(std::uint32_t max_visits) noexcept {
  return max_visits != 0 ? max_visits : DescentLimits::kNoLimit;
}

/// The limits that a query's settings set.
template <class Settings>
DescentLimits limits_of(const Settings& settings) noexcept {
  return {visit_limit(settings.max_visits), false};
}

/// Counts visits.
class Budget {
 public:
  explicit Budget(std::uint32_t most) noexcept : most_(most) {}

  /// How many of the next `wanted` visits may be made; they count as made.
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
