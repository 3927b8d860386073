#include "library/settings/numbers.h"

#include <fmt/format.h>
#include <cmath>
#include <vector>

namespace ist {
namespace {

/// "from 0 to below 1".
std::string in_words(const Range& range, double unit, const char* sign) {
  return fmt::format("{} {:g}{}{} {:g}{}", range.without_least ? "above" : "from",
                     range.least * unit, sign,
                     range.without_most ? (range.without_least ? " and below" : " to below")
                                        : (range.without_least ? ", at most" : " to"),
                     range.most * unit, sign);
}

}  // namespace

bool Range::holds(double x) const {
  return std::isfinite(x) && (without_least ? x > least : x >= least) &&
         (without_most ? x < most : x <= most);
}

std::optional<double> parse_number(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  return parse_whole<double>(text);
}

std::optional<double> parse_share(std::string_view text) {
  if (!text.ends_with('%')) return parse_number(text);
  const std::optional<double> percent = parse_number(text.substr(0, text.size() - 1));
  return percent ? std::optional(*percent / 100) : std::nullopt;
}

std::optional<Eigen::Vector3d> parse_factors(std::string_view text) {
  std::vector<double> given;
  for (;;) {
    const std::size_t comma = text.find(',');
    const std::optional<double> factor = parse_number(text.substr(0, comma));
    if (!factor || !std::isfinite(*factor) || *factor == 0) return std::nullopt;
    given.push_back(*factor);
    if (comma == text.npos) break;
    text.remove_prefix(comma + 1);
  }
  if (given.size() == 1) return Eigen::Vector3d::Constant(given[0]);
  if (given.size() == 3) return Eigen::Vector3d(given[0], given[1], given[2]);
  return std::nullopt;
}

std::optional<std::uint64_t> parse_bytes(std::string_view text) {
  constexpr std::string_view kUnits = "KMGT";
  unsigned shift = 0;
  if (!text.empty())
    if (const std::size_t unit = kUnits.find(text.back()); unit != std::string_view::npos) {
      shift = 10 * (static_cast<unsigned>(unit) + 1);
      text.remove_suffix(1);
    }
  const std::optional<std::uint64_t> count = parse_whole<std::uint64_t>(text);
  if (!count || *count > (std::numeric_limits<std::uint64_t>::max() >> shift)) return std::nullopt;
  return *count << shift;
}

bool take_number(const std::string& text, const Range& range, bool is_share, double& value) {
  const std::optional<double> parsed = is_share ? parse_share(text) : parse_number(text);
  if (!parsed || !range.holds(*parsed)) return false;
  value = *parsed;
  return true;
}

std::string in_words(const Range& range, bool is_share) {
  if (!std::isfinite(range.most))
    return range.without_least ? fmt::format("a finite number above {:g}", range.least)
                               : fmt::format("a finite number, {:g} or more", range.least);
  return "a number " + in_words(range, 1, "") +
         (is_share ? ", or " + in_words(range, 100, "%") : "");
}

}  // namespace ist
