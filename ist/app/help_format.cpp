#include "app/help_format.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <sstream>

namespace ist::app {
namespace {

constexpr std::size_t kNoTerminal = 80, kNarrowest = 60, kWidest = 100;
constexpr std::size_t kGroupIndent = 2;  ///< what CLI11 adds to groups of options

std::size_t terminal_width() {
  winsize size = {};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return kNoTerminal;
  return std::clamp<std::size_t>(size.ws_col, kNarrowest, kWidest);
}

/// Columns of UTF-8 text.
std::size_t columns(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0) != 0x80;
  }));
}

/// One line, cut before words; the lines that follow begin at `indent`.
std::string wrapped_line(const std::string& line, std::size_t indent, std::size_t width) {
  if (columns(line) <= width) return line;
  std::string out, current;
  std::size_t at = std::min(line.find_first_not_of(' '), line.size());
  current = line.substr(0, at);
  while (at < line.size()) {
    const std::size_t blank = std::min(line.find_first_not_of(' ', at), line.size());
    const std::size_t end = std::min(line.find(' ', blank), line.size());
    const std::string word = line.substr(blank, end - blank);
    if (columns(current) + (blank - at) + columns(word) > width && columns(current) > indent) {
      out += current + "\n";
      current = std::string(indent, ' ') + word;
    } else {
      current += line.substr(at, end - at);
    }
    at = end;
  }
  return out + current;
}

std::string wrapped(const std::string& text, std::size_t indent, std::size_t width) {
  std::istringstream lines(text);
  std::string out;
  for (std::string line; std::getline(lines, line);)
    out += wrapped_line(line, indent, width) + "\n";
  if (!text.empty() && text.back() != '\n') out.pop_back();
  return out;
}

}  // namespace

HelpFormat::HelpFormat() : width_(terminal_width() - kGroupIndent) {}

std::string HelpFormat::make_option(const CLI::Option* option, bool is_positional) const {
  return wrapped(Formatter::make_option(option, is_positional), get_column_width(), width_);
}

std::string HelpFormat::make_subcommand(const CLI::App* command) const {
  return wrapped(Formatter::make_subcommand(command), get_column_width(), width_);
}

std::string HelpFormat::make_description(const CLI::App* app) const {
  return wrapped(Formatter::make_description(app), 0, width_);
}

/// Examples and lists stay as they are.
std::string HelpFormat::make_footer(const CLI::App* app) const {
  std::istringstream lines(Formatter::make_footer(app));
  std::string out;
  for (std::string line; std::getline(lines, line);)
    out += (line.starts_with("Example") || line.starts_with(' ') ? line
                                                                 : wrapped_line(line, 0, width_)) +
           "\n";
  return out;
}

}  // namespace ist::app
