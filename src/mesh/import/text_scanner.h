#pragma once

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <optional>

#include "mesh/import/source_file.h"

namespace ist {

/// Words of a text file, line by line, with the line number for messages. Numbers are read in the C
/// locale, whatever the process's locale.
class TextScanner {
 public:
  /// Text from byte `start` of the file on, whose first line is number `line`. Everything from
  /// `comment` to the end of a line is skipped (0: no comments). A byte-order mark is skipped.
  /// Lines end by LF, CR LF or CR.
  TextScanner(const SourceFile& file, char comment, std::size_t start = 0, std::size_t line = 1);

  bool next_line();                  ///< false at the end of the file
  std::string_view word();           ///< the next in this line; empty at its end
  std::string_view word_anywhere();  ///< the next in this or a later line; empty at the file's end

  std::size_t next_line_start() const { return position_; }  ///< byte of the file
  std::size_t line() const { return line_number_; }
  std::size_t bytes_left() const { return text_.size() - position_ + rest_.size(); }
  [[noreturn]] void fail(const std::string& what) const;

  /// Numbers from words. Throw Error unless the whole word is one. A real may be infinite or NaN.
  double real(std::string_view word) const;
  std::int64_t integer(std::string_view word) const;

 private:
  const SourceFile& file_;
  std::string_view text_;     ///< the whole file
  std::string_view rest_;     ///< of this line
  std::size_t position_ = 0;  ///< start of the next line
  std::size_t line_number_ = 0;
  char comment_;
  char end_ = '\n';  ///< of a line
};

/// Calls visit(word) for every word of a text, separated by blanks and line ends.
template <class Visit>
void for_words(std::string_view text, const Visit& visit) {
  constexpr std::string_view kSpace = " \t\r\n";
  for (std::size_t at = text.find_first_not_of(kSpace); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(kSpace, at), text.size());
    visit(text.substr(at, end - at));
    at = text.find_first_not_of(kSpace, end);
  }
}

/// Parses a whole text as a decimal number, or returns nothing.
template <class T>
std::optional<T> parse_whole(std::string_view text) {
  T value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Parses a whole word as a number, or returns nothing. Overflow gives infinity, underflow 0.
std::optional<double> parse_real(std::string_view word);

}  // namespace ist
