#include "app/reference.h"

#include <algorithm>
#include <cctype>
#include <sstream>

namespace ist::app {
namespace {

/// "TEXT:{a,b}" and "a|b|SOMETHING" say what there is to choose from; words in capitals stand for
/// others, letters for themselves.
void split_type(const std::string& type, OptionReference& out) {
  const std::size_t open = type.find(":{");
  const bool listed = open != std::string::npos;
  out.value = type.substr(0, open);
  if (!listed && type.find('|') == std::string::npos) return;
  std::istringstream choices(listed ? type.substr(open + 2, type.find('}', open) - open - 2)
                                    : type);
  for (std::string choice; std::getline(choices, choice, listed ? ',' : '|');)
    if (listed || choice.size() == 1 || std::islower(static_cast<unsigned char>(choice[0])) != 0)
      out.choices.push_back(choice);
}

OptionReference reference_of(const CLI::Option& option) {
  OptionReference out;
  out.positional = option.get_positional();
  out.required = option.get_required();
  out.takes_value = option.get_items_expected_max() > 0;
  if (out.positional) {
    out.names = {option.get_name(true)};
  } else {
    for (const std::string& name : option.get_snames()) out.names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) out.names.push_back("--" + name);
  }
  if (out.takes_value) split_type(option.get_type_name(), out);
  out.standard = option.get_default_str();
  out.help = option.get_description();
  return out;
}

void collect(const CLI::App& app, std::vector<OptionReference>& out) {
  for (const CLI::Option* option : app.get_options([](const CLI::Option*) { return true; }))
    out.push_back(reference_of(*option));
  // Groups of options are commands without a name.
  for (const CLI::App* group : app.get_subcommands([](const CLI::App*) { return true; }))
    if (group->get_name().empty()) collect(*group, out);
}

}  // namespace

std::vector<CommandReference> commands_of(const CLI::App& app) {
  std::vector<CommandReference> commands;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (command->get_name().empty()) continue;
    CommandReference& out = commands.emplace_back();
    out.name = command->get_name();
    out.help = command->get_description();
    out.footer = command->get_footer();
    collect(*command, out.options);
    std::stable_partition(out.options.begin(), out.options.end(),
                          [](const OptionReference& option) { return option.positional; });
  }
  return commands;
}

}  // namespace ist::app
