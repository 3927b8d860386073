#pragma once

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>

// Checks of number options. CLI11's own print their range in full, with 309 digits for the largest
// double.

namespace ist::app {

/// 0, 1, 2, … of at most 64 bits.
inline std::string is_count(const std::string& text) {
  std::uint64_t value = 0;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, value);
  return error == std::errc() && end == last
             ? ""
             : "'" + text + "' is not a whole number in digits, 0 or more";
}

/// A finite number ≥ 0.
inline std::string is_not_negative(const std::string& text) {
  double value = 0;
  return CLI::detail::lexical_cast(text, value) && std::isfinite(value) && value >= 0
             ? ""
             : "'" + text + "' is not a finite number, 0 or more";
}

/// A number in [0, 1).
inline std::string is_slack(const std::string& text) {
  double value = 0;
  return CLI::detail::lexical_cast(text, value) && value >= 0 && value < 1
             ? ""
             : "'" + text + "' is not a number from 0 to below 1";
}

/// A finite number > 0.
inline std::string is_positive(const std::string& text) {
  double value = 0;
  return CLI::detail::lexical_cast(text, value) && std::isfinite(value) && value > 0
             ? ""
             : "'" + text + "' is not a finite number above 0";
}

}  // namespace ist::app
