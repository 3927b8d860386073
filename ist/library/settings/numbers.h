#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>

#include "mesh/import/text_scanner.h"

// Numbers as people write them, on a command line or in a file, under one rule: digits are decimal,
// whatever zeros come first, and what is no number or out of range (NaN is) is refused.

namespace ist {

/// The finite numbers that a setting takes.
struct Range {
  double least = 0, most = std::numeric_limits<double>::infinity();
  bool without_least = false, without_most = false;

  bool holds(double x) const;
};

/// A number as the C locale writes it, nan and inf included.
std::optional<double> parse_number(std::string_view text);

/// A number, or a percentage: 0.5 or 50%.
std::optional<double> parse_share(std::string_view text);

/// One finite number other than 0 for all three axes, or three with commas between.
std::optional<Eigen::Vector3d> parse_factors(std::string_view text);

/// Bytes as people write them: 4096, 512M, 10G; units K, M, G and T are powers of 1024.
std::optional<std::uint64_t> parse_bytes(std::string_view text);

/// Sets `value` to a whole number in [least, most]; false where the text is none.
template <class T>
bool take_whole(const std::string& text, T least, T most, T& value) {
  const std::optional<T> parsed = parse_whole<T>(text);
  if (!parsed || *parsed < least || *parsed > most) return false;
  value = *parsed;
  return true;
}

/// The same for a number in a range, or a share.
bool take_number(const std::string& text, const Range& range, bool is_share, double& value);

/// "a number from 0 to below 1"; of a share also in percent.
std::string in_words(const Range& range, bool is_share);

}  // namespace ist
