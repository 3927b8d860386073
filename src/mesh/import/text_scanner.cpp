#include "mesh/import/text_scanner.h"

#include <limits>
#include <string>
#include <system_error>

namespace ist {
namespace {

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

std::string_view without_plus(std::string_view word) {
  const bool plus = word.size() > 1 && word[0] == '+' && word[1] != '-';
  return plus ? word.substr(1) : word;
}

}  // namespace

TextScanner::TextScanner(const SourceFile& file, char comment, std::size_t start, std::size_t line)
    : file_(file), text_(file.bytes), position_(start), line_number_(line - 1), comment_(comment) {
  if (start == 0) position_ = text_.size() - without_byte_order_mark(text_).size();
  // All lines end like the first; old files have only carriage returns.
  const std::size_t end = text_.find_first_of("\r\n");
  const std::size_t beyond = text_.find_first_not_of('\r', end);
  if (end != beyond && (beyond == std::string_view::npos || text_[beyond] != '\n')) end_ = '\r';
}

bool TextScanner::next_line() {
  if (position_ >= text_.size()) {
    rest_ = {};
    return false;
  }
  const std::size_t end = std::min(text_.find(end_, position_), text_.size());
  rest_ = text_.substr(position_, end - position_);
  position_ = std::min(end + 1, text_.size());
  ++line_number_;
  if (comment_ != 0) rest_ = rest_.substr(0, rest_.find(comment_));
  return true;
}

std::string_view TextScanner::word() {
  std::size_t begin = 0;
  while (begin < rest_.size() && is_space(rest_[begin])) ++begin;
  std::size_t end = begin;
  while (end < rest_.size() && !is_space(rest_[end])) ++end;
  const std::string_view result = rest_.substr(begin, end - begin);
  rest_.remove_prefix(end);
  return result;
}

std::string_view TextScanner::word_anywhere() {
  for (;;) {
    const std::string_view result = word();
    if (!result.empty() || !next_line()) return result;
  }
}

void TextScanner::fail(const std::string& what) const { fail_at_line(file_, line_number_, what); }

double TextScanner::real(std::string_view word) const {
  if (word.empty()) fail("a number is missing");
  const std::optional<double> value = parse_real(word);
  if (!value) fail(in_quotes(word) + " is not a number");
  return *value;
}

std::int64_t TextScanner::integer(std::string_view word) const {
  if (word.empty()) fail("a whole number is missing");
  const std::string_view digits = without_plus(word);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error == std::errc::result_out_of_range) fail(in_quotes(word) + " is out of range");
  if (error != std::errc() || end != digits.data() + digits.size())
    fail(in_quotes(word) + " is not a whole number");
  return value;
}

std::optional<double> parse_real(std::string_view word) {
  const std::string_view digits = without_plus(word);
  const char* const last = digits.data() + digits.size();
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), last, value);
  if (end != last) return std::nullopt;
  if (error == std::errc()) return value;
  if (error != std::errc::result_out_of_range) return std::nullopt;
  // from_chars does not distinguish overflow from underflow. The exponent does, for usual
  // mantissas.
  const std::size_t exponent = digits.find_first_of("eE");
  const bool tiny = exponent != std::string_view::npos && digits.substr(exponent + 1, 1) == "-";
  if (tiny) return 0.0;
  return digits[0] == '-' ? -std::numeric_limits<double>::infinity()
                          : std::numeric_limits<double>::infinity();
}

}  // namespace ist
