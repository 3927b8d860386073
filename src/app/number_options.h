#pragma once

#include <CLI/CLI.hpp>
#include <charconv>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

// Options that take a number, under one rule: digits are decimal, whatever zeros come first, and
// what is no number or out of range (NaN is) ends with exit code 2, the option's name and its
// range.

namespace ist::app {

/// The finite numbers that an option takes.
struct Range {
  double least = 0, most = std::numeric_limits<double>::infinity();
  bool without_least = false, without_most = false;

  bool holds(double x) const;
};

/// A number as the C locale writes it, nan and inf included.
std::optional<double> parse_number(std::string_view text);

/// A whole number in decimal digits.
template <class T>
std::optional<T> parse_whole(std::string_view text) {
  T value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 10);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// An option that refuses what `take` returns false for: "NAME: 'text' is not MEANING".
CLI::Option* add_parsed(CLI::App* command, const std::string& name, const std::string& meaning,
                        const std::function<bool(const std::string&)>& take,
                        const std::string& help);

/// A whole number in [least, most]; `value` holds the default.
template <class T>
CLI::Option* add_whole(CLI::App* command, const std::string& name, T& value,
                       const std::string& help, T least = 0,
                       T most = std::numeric_limits<T>::max()) {
  const std::string range = std::to_string(least) + " to " + std::to_string(most);
  return add_parsed(
             command, name, "a whole number from " + range,
             [&value, least, most](const std::string& text) {
               const std::optional<T> parsed = parse_whole<T>(text);
               if (!parsed || *parsed < least || *parsed > most) return false;
               value = *parsed;
               return true;
             },
             help)
      ->type_name("INT")
      ->default_str(std::to_string(value));
}

/// A number in a range; `value` holds the default.
CLI::Option* add_real(CLI::App* command, const std::string& name, double& value, const Range& range,
                      const std::string& help);

/// The same, and a percentage too: 0.5 or 50%.
CLI::Option* add_share(CLI::App* command, const std::string& name, double& value,
                       const Range& range, const std::string& help);

}  // namespace ist::app
