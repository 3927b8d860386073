#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>

#include "mesh/import/text_scanner.h"

// Numbers as people write them, on a command line or in a file, under one rule: digits are decimal,
// leading zeros are allowed, and invalid or out-of-range values (such as NaN) are refused.

namespace ist {

/// The finite numbers that a setting accepts.
struct Range {
  double least = 0, most = std::numeric_limits<double>::infinity();
  bool without_least = false, without_most = false;

  bool holds(double x) const;
};

/// A number in the C locale, nan and inf included.
std::optional<double> parse_number(std::string_view text);

/// A number, or a percentage: 0.5 or 50%.
std::optional<double> parse_share(std::string_view text);

/// One nonzero finite number for all three axes, or three separated by commas.
std::optional<Eigen::Vector3d> parse_factors(std::string_view text);

/// Bytes as people write them: 4096, 512M, 10G; units K, M, G and T are powers of 1024.
std::optional<std::uint64_t> parse_bytes(std::string_view text);

/// Sets `value` to an integer in [least, most]; returns false if the text is not one.
template <class T>
bool take_whole(const std::string& text, T least, T most, T& value) {
  const std::optional<T> parsed = parse_whole<T>(text);
  if (!parsed || *parsed < least || *parsed > most) return false;
  value = *parsed;
  return true;
}

/// The same for a number in a range, or a share.
bool take_number(const std::string& text, const Range& range, bool is_share, double& value);

/// "a number from 0 to below 1"; for a share also in percent.
std::string in_words(const Range& range, bool is_share);

}  // namespace ist
