#include "app/csv_reader.h"

#include <algorithm>

#include <ist/error.h>

namespace ist::app {
namespace {
constexpr const char* kBlank = " \t\r";
}

bool CsvReader::next(std::vector<std::string>& fields) {
  do {
    if (!next_line()) return false;
    row_line_ = lines_;
  } while (line_.find_first_not_of(kBlank) == std::string::npos);
  fields.clear();
  for (std::size_t at = 0; at <= line_.size(); ++at) fields.push_back(field(at));
  return true;
}

void CsvReader::fail(const std::string& what) const {
  throw Error(name_ + ":" + std::to_string(row_line_) + ": " + what);
}

bool CsvReader::next_line() {
  if (!std::getline(text_, line_)) return false;
  if (lines_++ == 0 && line_.starts_with("\xEF\xBB\xBF")) line_.erase(0, 3);
  return true;
}

/// The field that begins at `at`, which is left on the comma or the line's end after it.
std::string CsvReader::field(std::size_t& at) {
  const std::size_t first = line_.find_first_not_of(kBlank, at);
  if (first != std::string::npos && line_[first] == '"') {
    at = first + 1;
    return quoted_field(at);
  }
  const std::size_t end = std::min(line_.find(',', at), line_.size());
  std::string text = line_.substr(at, end - at);
  at = end;
  if (text.find('"') != std::string::npos)
    fail("a quote inside an unquoted field; quote the whole field and double the quotes inside it");
  const std::size_t last = text.find_last_not_of(kBlank);
  text.erase(last == std::string::npos ? 0 : last + 1);
  return text.erase(0, std::min(text.find_first_not_of(kBlank), text.size()));
}

std::string CsvReader::quoted_field(std::size_t& at) {
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

}  // namespace ist::app
