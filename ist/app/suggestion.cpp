#include "app/suggestion.h"

#include <algorithm>

#include "app/reference.h"
#include "library/settings/spelling.h"

namespace ist::app {

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

}  // namespace ist::app
