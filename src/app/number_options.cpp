#include "app/number_options.h"

#include <fmt/format.h>

#include <cmath>

namespace ist::app {
namespace {

/// "from 0 to below 1".
std::string in_words(const Range& range, double unit, const char* sign) {
  return fmt::format("{} {:g}{}{} {:g}{}", range.without_least ? "above" : "from",
                     range.least * unit, sign,
                     range.without_most ? (range.without_least ? " and below" : " to below")
                                        : (range.without_least ? ", at most" : " to"),
                     range.most * unit, sign);
}

std::string in_words(const Range& range) {
  if (std::isfinite(range.most)) return "a number " + in_words(range, 1, "");
  return range.without_least ? fmt::format("a finite number above {:g}", range.least)
                             : fmt::format("a finite number, {:g} or more", range.least);
}

bool take(const std::optional<double>& parsed, const Range& range, double& value) {
  if (!parsed || !range.holds(*parsed)) return false;
  value = *parsed;
  return true;
}

std::optional<double> parse_share(const std::string& text) {
  if (!text.ends_with('%')) return parse_number(text);
  const std::optional<double> percent =
      parse_number(std::string_view(text).substr(0, text.size() - 1));
  return percent ? std::optional(*percent / 100) : std::nullopt;
}

}  // namespace

bool Range::holds(double x) const {
  return std::isfinite(x) && (without_least ? x > least : x >= least) &&
         (without_most ? x < most : x <= most);
}

std::optional<double> parse_number(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

CLI::Option* add_parsed(CLI::App* command, const std::string& name, const std::string& meaning,
                        const std::function<bool(const std::string&)>& take,
                        const std::string& help) {
  return command->add_option_function<std::string>(
      name,
      [name, meaning, take](const std::string& text) {
        if (!take(text))
          throw CLI::ValidationError(name, fmt::format("'{}' is not {}", text, meaning));
      },
      help);
}

CLI::Option* add_real(CLI::App* command, const std::string& name, double& value, const Range& range,
                      const std::string& help) {
  return add_parsed(
             command, name, in_words(range),
             [&value, range](const std::string& text) {
               return take(parse_number(text), range, value);
             },
             help)
      ->type_name("NUMBER")
      ->default_str(fmt::format("{:g}", value));
}

CLI::Option* add_share(CLI::App* command, const std::string& name, double& value,
                       const Range& range, const std::string& help) {
  return add_parsed(
             command, name, in_words(range) + ", or " + in_words(range, 100, "%"),
             [&value, range](const std::string& text) {
               return take(parse_share(text), range, value);
             },
             help)
      ->type_name("SHARE")
      ->default_str(fmt::format("{:g}", value));
}

}  // namespace ist::app
