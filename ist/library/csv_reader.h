#pragma once

#include <ist/types.h>
#include <algorithm>
#include <istream>
#include <utility>
#include <vector>

namespace ist {

/// Rows of comma-separated text (RFC 4180): a quoted field may contain commas, line breaks and
/// doubled quotes; other fields lose surrounding blanks. Skips empty rows, and the UTF-8 mark that
/// Excel writes.
class CsvReader {
 public:
  /// `name`: of the file, for messages.
  CsvReader(std::istream& text, std::string name) : text_(text), name_(std::move(name)) {}

  /// False at the end. Throws Error.
  bool next(std::vector<std::string>& fields) {
    do {
      if (!next_line()) return false;
      row_line_ = lines_;
    } while (line_.find_first_not_of(kBlank) == std::string::npos);
    fields.clear();
    for (std::size_t at = 0; at <= line_.size(); ++at) fields.push_back(field(at));
    return true;
  }

  /// Throws Error that names the line at which the last row began.
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(name_ + ":" + std::to_string(row_line_) + ": " + what);
  }

 private:
  static constexpr const char* kBlank = " \t\r";

  bool next_line() {
    if (!std::getline(text_, line_)) return false;
    if (lines_++ == 0 && line_.starts_with("\xEF\xBB\xBF")) line_.erase(0, 3);
    return true;
  }

  /// Reads the field at `at`, and moves `at` to the following comma or line end.
  std::string field(std::size_t& at) {
    const std::size_t first = line_.find_first_not_of(kBlank, at);
    if (first != std::string::npos && line_[first] == '"') {
      at = first + 1;
      return quoted_field(at);
    }
    const std::size_t end = std::min(line_.find(',', at), line_.size());
    std::string text = line_.substr(at, end - at);
    at = end;
    if (text.find('"') != std::string::npos)
      fail(
          "a quote inside an unquoted field; quote the whole field and double the quotes inside "
          "it");
    const std::size_t last = text.find_last_not_of(kBlank);
    text.erase(last == std::string::npos ? 0 : last + 1);
    return text.erase(0, std::min(text.find_first_not_of(kBlank), text.size()));
  }

  std::string quoted_field(std::size_t& at) {
    std::string text;
    while (true) {
      if (at >= line_.size()) {
        if (!next_line()) fail("a closing quote is missing");
        text += '\n';
        at = 0;
      } else if (line_[at] != '"') {
        text += line_[at++];
      } else if (at + 1 < line_.size() && line_[at + 1] == '"') {
        text += '"';
        at += 2;
      } else {
        break;
      }
    }
    const std::size_t end = line_.find_first_not_of(kBlank, at + 1);
    at = std::min(end, line_.size());
    if (at < line_.size() && line_[at] != ',') fail("text after a closing quote");
    return text;
  }

  std::istream& text_;
  std::string name_, line_;
  std::size_t lines_ = 0, row_line_ = 0;
};

}  // namespace ist
