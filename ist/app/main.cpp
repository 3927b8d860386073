#include <ist/types.h>
#include <ist/version.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <unistd.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <sstream>
#include <system_error>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/reference.h"
#include "library/settings/spelling.h"

namespace ist::app {
namespace {

constexpr std::size_t kNoTerminal = 80, kNarrowest = 60, kWidest = 100;
constexpr std::size_t kGroupIndent = 2;  ///< what CLI11 adds to groups of options

std::size_t terminal_width() {
  winsize size = {};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return kNoTerminal;
  return std::clamp<std::size_t>(size.ws_col, kNarrowest, kWidest);
}

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

/// CLI11's help in lines of the terminal's width: 80 columns without a terminal, 100 at most.
class HelpFormat : public CLI::Formatter {
 public:
  HelpFormat() : width_(terminal_width() - kGroupIndent) {}

  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    return wrapped(Formatter::make_option(option, is_positional), get_column_width(), width_);
  }

  std::string make_subcommand(const CLI::App* command) const override {
    return wrapped(Formatter::make_subcommand(command), get_column_width(), width_);
  }

  std::string make_description(const CLI::App* app) const override {
    return wrapped(Formatter::make_description(app), 0, width_);
  }

  std::string make_footer(const CLI::App* app) const override {
    std::istringstream lines(Formatter::make_footer(app));
    std::string out;
    for (std::string line; std::getline(lines, line);)
      out +=
          (line.starts_with("Example") || line.starts_with(' ') ? line
                                                                : wrapped_line(line, 0, width_)) +
          "\n";
    return out;
  }

 private:
  std::size_t width_;
};

/// For a command line that was refused: the command or the option that its first unknown word was
/// probably meant to be. Empty if there is none.
std::string suggestion(const CLI::App& app, std::span<char* const> arguments) {
  if (arguments.empty()) return "";
  const std::vector<CommandReference> commands = commands_of(app);
  std::vector<std::string> known;
  for (const CommandReference& command : commands) known.push_back(command.name);
  const auto command =
      std::find_if(commands.begin(), commands.end(),
                   [&](const CommandReference& one) { return one.name == arguments[0]; });
  if (command == commands.end()) return nearest_word(arguments[0], known);
  known.clear();
  for (const OptionReference& option : command->options)
    if (!option.positional) known.insert(known.end(), option.names.begin(), option.names.end());
  for (const char* const argument : arguments.subspan(1)) {
    const std::string word = std::string(argument).substr(0, std::string(argument).find('='));
    if (!word.starts_with("--") || std::count(known.begin(), known.end(), word) != 0) continue;
    if (std::string meant = nearest_word(word, known); !meant.empty()) return meant;
  }
  return "";
}

}  // namespace
}  // namespace ist::app

int main(int argc, char** argv) {
  using namespace ist::app;
  install_interrupt_handler();
  // https://no-color.org
  const char* const no_color = std::getenv("NO_COLOR");
  spdlog::set_default_logger(spdlog::stderr_color_mt("ist", no_color != nullptr && *no_color != '\0'
                                                                ? spdlog::color_mode::never
                                                                : spdlog::color_mode::automatic));
  spdlog::set_pattern("ist: %^%l%$: %v");
  CLI::App app(
      "Sphere packings, inner sphere trees and overlap volumes of two solids.\n"
      "Lengths are in [u], the mesh's own unit.",
      "ist");
  app.formatter(std::make_shared<HelpFormat>());
  app.set_version_flag("--version", "ist " IST_VERSION_STRING);
  app.footer(
      "Exit codes: 0 success, 1 error, 2 wrong usage, 3 check found a violation or clash a "
      "clash, 130 interrupted.");
  add_bake(app);
  add_cache(app);
  add_summary(app);
  add_query(app);
  add_info(app);
  add_check(app);
  add_clash(app);
  add_export(app);
  add_medial(app);
  add_sample(app);
  add_spheres(app);
  add_reference(app);
  try {
    app.parse(argc, argv);
    if (app.get_subcommands().empty()) throw CLI::RequiredError("A subcommand");
    // A full disk may show only here.
    if (std::fflush(stdout) != 0)
      throw ist::Error("standard output: cannot write: " + std::generic_category().message(errno));
    return 0;
  } catch (const CLI::ParseError& error) {
    if (app.exit(error) == 0) return 0;
    if (const std::string meant = suggestion(app, {argv + 1, argv + argc}); !meant.empty())
      std::fprintf(stderr, "Did you mean '%s'?\n", meant.c_str());
    return kExitUsage;
  } catch (const ExitCode& code) {
    return code.value;
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return kExitError;
  }
}
