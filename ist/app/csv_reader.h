#pragma once

#include <cstddef>
#include <istream>
#include <string>
#include <vector>

namespace ist::app {

/// Rows of comma-separated text (RFC 4180): a field in quotes may hold commas, line breaks and
/// doubled quotes; others lose the blanks around them. Rows without anything are passed over, and
/// so is the mark of UTF-8 that Excel writes.
class CsvReader {
 public:
  /// `name`: of the file, for messages.
  CsvReader(std::istream& text, std::string name) : text_(text), name_(std::move(name)) {}

  /// False at the end. Throws Error.
  bool next(std::vector<std::string>& fields);

  /// Throws Error that names the line at which the last row began.
  [[noreturn]] void fail(const std::string& what) const;

 private:
  bool next_line();
  std::string field(std::size_t& at);
  std::string quoted_field(std::size_t& at);

  std::istream& text_;
  std::string name_, line_;
  std::size_t lines_ = 0, row_line_ = 0;
};

}  // namespace ist::app
