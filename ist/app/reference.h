#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace ist::app {

struct OptionReference {
  std::vector<std::string> names;  ///< "-o", "--output"; of a positional argument its name alone
  bool positional = false, required = false;
  bool takes_value = false;
  std::string value;                 ///< "INT", "TEXT", …; empty without one
  std::vector<std::string> choices;  ///< all values, if they are few
  std::string standard;              ///< the default; empty: none to document
  std::string help;

  /// True if a value may be the name of a file.
  bool takes_text() const { return value == "TEXT" && choices.empty(); }
};

struct CommandReference {
  std::string name, help, footer;
  std::vector<OptionReference> options;
};

/// The commands of `app` in the order in which it lists them.
std::vector<CommandReference> commands_of(const CLI::App& app);

/// The man page of one command, and that of the program itself.
std::string man_page(const CommandReference& command);
std::string man_page(const CLI::App& app);

}  // namespace ist::app
