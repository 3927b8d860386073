#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <limits>
#include <optional>
#include <string>

#include "library/settings/numbers.h"

// Options that take a number: what is none or out of range ends with exit code 2, the option's name
// and its range.

namespace ist::app {

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

/// A share in a range, 0.005 or 0.5%; `value` holds the default.
CLI::Option* add_share(CLI::App* command, const std::string& name, double& value,
                       const Range& range, const std::string& help);

/// Bytes: 4096, 512M, 10G. `value` holds the default; 0 is said to be none.
CLI::Option* add_bytes(CLI::App* command, const std::string& name, std::uint64_t& value,
                       const std::string& help);

}  // namespace ist::app
