#include "app/reference.h"

#include <fmt/format.h>
#include <ist/types.h>
#include <ist/version.h>
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <memory>
#include <sstream>
#include <string_view>
#include <system_error>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/options.h"

namespace ist::app {
namespace {

std::string words(const std::vector<CommandReference>& commands) {
  std::string out;
  for (const CommandReference& command : commands) out += (out.empty() ? "" : " ") + command.name;
  return out;
}

/// The help up to its first full stop: the part that fits beside an option. "e.g. 1%" has none.
std::string short_help(const std::string& help) {
  for (std::size_t i = 0; i < help.size(); ++i) {
    const bool sentence_ends = help[i] == '.' && i + 2 < help.size() && help[i + 1] == ' ' &&
                               help[i + 2] >= 'A' && help[i + 2] <= 'Z';
    if (help[i] == ';' || help[i] == '\n' || sentence_ends) return help.substr(0, i);
  }
  return help;
}

std::string replaced(const std::string& text, std::string_view unsafe, const std::string& before) {
  std::string out;
  for (const char c : text) {
    if (unsafe.find(c) != std::string_view::npos) out += before;
    out += c;
  }
  return out;
}

std::string shell_quoted(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return fmt::format("'{}'", out);
}

// Completion scripts for `ist`: for bash, zsh and fish.
std::string bash_completion(const std::vector<CommandReference>& commands) {
  std::string out = "# bash completion of ist\n_ist() {\n";
  out += "  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]}\n";
  out += "  COMPREPLY=()\n  if [[ $COMP_CWORD == 1 ]]; then\n";
  out += fmt::format(
      "    COMPREPLY=($(compgen -W '{} --help --version' -- \"$cur\"))\n    return\n"
      "  fi\n  case ${{COMP_WORDS[1]}}:$prev in\n",
      words(commands));
  for (const CommandReference& command : commands)
    for (const OptionReference& option : command.options) {
      if (option.positional || !option.takes_value) continue;
      std::string pattern;
      for (const std::string& name : option.names)
        pattern += fmt::format("{}{}:{}", pattern.empty() ? "" : "|", command.name, name);
      if (!option.choices.empty())
        out += fmt::format(
            "    {})\n      COMPREPLY=($(compgen -W '{}' -- \"$cur\"))\n      return ;;\n", pattern,
            fmt::join(option.choices, " "));
      else if (option.takes_text())
        out += fmt::format("    {}) compopt -o default; return ;;\n", pattern);
      else
        out += fmt::format("    {}) return ;;\n", pattern);
    }
  out += "  esac\n  if [[ $cur != -* ]]; then\n    case ${COMP_WORDS[1]} in\n";
  for (const CommandReference& command : commands)
    for (const OptionReference& option : command.options)
      if (option.positional && !option.choices.empty())
        out += fmt::format("      {}) COMPREPLY=($(compgen -W '{}' -- \"$cur\")) ;;\n",
                           command.name, fmt::join(option.choices, " "));
  out += "      *) compopt -o default ;;\n    esac\n    return\n  fi\n";
  out += "  case ${COMP_WORDS[1]} in\n";
  for (const CommandReference& command : commands) {
    std::string options;
    for (const OptionReference& option : command.options)
      if (!option.positional) options += (options.empty() ? "" : " ") + option.names.back();
    out += fmt::format("    {}) COMPREPLY=($(compgen -W '{}' -- \"$cur\")) ;;\n", command.name,
                       options);
  }
  return out + "  esac\n}\ncomplete -F _ist ist\n";
}

std::string zsh_completion(const std::vector<CommandReference>& commands) {
  const auto text = [](const std::string& help) {
    return replaced(short_help(help), "\\[]:", "\\");
  };
  const auto actions = [](const OptionReference& option) -> std::string {
    if (!option.choices.empty()) return fmt::format("({})", fmt::join(option.choices, " "));
    return option.takes_text() ? "_files" : " ";
  };
  std::string out = "#compdef ist\n\n_ist() {\n  if (( CURRENT == 2 )); then\n";
  out += "    local -a commands=(\n";
  for (const CommandReference& command : commands)
    out += fmt::format(
        "      {}\n",
        shell_quoted(fmt::format("{}:{}", command.name, replaced(command.help, "\\:", "\\"))));
  out += "    )\n    _describe 'command' commands\n    return\n  fi\n";
  out += "  local command=$words[2]\n  shift words\n  (( CURRENT-- ))\n  case $command in\n";
  for (const CommandReference& command : commands) {
    out += fmt::format("    {})\n      _arguments \\\n", command.name);
    for (const OptionReference& option : command.options) {
      if (option.positional) {
        out += "        " +
               shell_quoted(fmt::format(":{}:{}", text(option.help), actions(option))) + " \\\n";
        continue;
      }
      for (const std::string& name : option.names) {
        std::string spec = name;
        if (option.takes_value && name.starts_with("--")) spec += "=";
        spec += fmt::format("[{}]", text(option.help));
        if (option.takes_value) spec += fmt::format(":{}:{}", option.value, actions(option));
        out += "        " + shell_quoted(spec) + " \\\n";
      }
    }
    out += "        && return ;;\n";
  }
  return out + "  esac\n}\n\n_ist \"$@\"\n";
}

std::string fish_completion(const std::vector<CommandReference>& commands) {
  std::string out = "# fish completion of ist\ncomplete -c ist -n __fish_use_subcommand -f\n";
  const auto text = [](const std::string& help) { return "'" + replaced(help, "\\'", "\\") + "'"; };
  for (const CommandReference& command : commands)
    out += fmt::format("complete -c ist -n __fish_use_subcommand -a {} -d {}\n", command.name,
                       text(command.help));
  for (const CommandReference& command : commands)
    for (const OptionReference& option : command.options) {
      if (option.positional) {
        if (!option.choices.empty())
          out += fmt::format("complete -c ist -n '__fish_seen_subcommand_from {}' -fa '{}'\n",
                             command.name, fmt::join(option.choices, " "));
        continue;
      }
      out += fmt::format("complete -c ist -n '__fish_seen_subcommand_from {}'", command.name);
      for (const std::string& name : option.names)
        out += name.starts_with("--") ? fmt::format(" -l {}", name.substr(2))
                                      : fmt::format(" -s {}", name.substr(1));
      if (option.takes_value) {
        if (!option.choices.empty())
          out += fmt::format(" -xa '{}'", fmt::join(option.choices, " "));
        else
          out += option.takes_text() ? " -r" : " -x";
      }
      out += fmt::format(" -d {}\n", text(short_help(option.help)));
    }
  return out;
}

/// Text escaped for roff: hyphens that can be copied, no escapes, no requests.
std::string roff(const std::string& text) {
  std::string out;
  bool line_begins = true;
  for (const char c : text) {
    if (line_begins && (c == '.' || c == '\'')) out += "\\&";
    line_begins = c == '\n';
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
  }
  return out;
}

std::string title(const std::string& name) {
  return fmt::format(".TH \"{}\" 1 \"\" \"ist {}\" \"User Commands\"\n", name, IST_VERSION_STRING);
}

std::string verbatim(const std::string& heading, const std::string& text) {
  if (text.empty()) return "";
  return fmt::format(".SH {}\n.nf\n{}\n.fi\n", heading, roff(text));
}

std::string described(const OptionReference& option) {
  std::string names;
  for (const std::string& name : option.names)
    names += (names.empty() ? "" : ", ") + fmt::format("\\fB{}\\fR", roff(name));
  if (!option.positional && option.takes_value)
    names += fmt::format(" \\fI{}\\fR", roff(option.value));
  std::string text = fmt::format(".TP\n{}\n{}", names, roff(option.help));
  if (!text.ends_with('.')) text += '.';
  if (!option.choices.empty() && option.value.find('|') == std::string::npos)
    text += fmt::format(" One of: {}.", roff(fmt::format("{}", fmt::join(option.choices, ", "))));
  if (!option.standard.empty()) text += fmt::format(" Default: {}.", roff(option.standard));
  if (option.required && !option.positional) text += " Required.";
  return text + "\n";
}

void write_manual(const CLI::App& app, const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw Error(folder + ": cannot create the folder: " + error.message());
  const InterruptGuard guard;
  const std::filesystem::path in = folder;
  write_text((in / "ist.1").string(), man_page(app));
  for (const CommandReference& command : commands_of(app))
    write_text((in / ("ist-" + command.name + ".1")).string(), man_page(command));
}

/// "TEXT:{a,b}" and "a|b|SOMETHING" list the choices; words in capitals are placeholders, others
/// literal.
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

std::string man_page(const CommandReference& command) {
  std::string out = title("IST-" + command.name);
  out += fmt::format(".SH NAME\nist\\-{} \\- {}\n", command.name, roff(command.help));
  out += fmt::format(".SH SYNOPSIS\n.B ist {}\n[\\fIOPTIONS\\fR]", command.name);
  for (const OptionReference& option : command.options)
    if (option.positional) out += fmt::format(" \\fI{}\\fR", roff(option.names.front()));
  out += "\n.SH OPTIONS\n";
  for (const OptionReference& option : command.options) out += described(option);
  return out + verbatim("NOTES", command.footer) + ".SH SEE ALSO\n.BR ist (1)\n";
}

std::string man_page(const CLI::App& app) {
  std::string out = title("IST");
  out += ".SH NAME\nist \\- sphere packings, inner sphere trees and penetration volumes\n";
  out += ".SH SYNOPSIS\n.B ist\n\\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n";
  out += fmt::format(".SH DESCRIPTION\n{}\n.SH COMMANDS\n", roff(app.get_description()));
  for (const CommandReference& command : commands_of(app))
    out += fmt::format(".TP\n.BR ist\\-{} (1)\n{}\n", command.name, roff(command.help));
  out += ".SH ENVIRONMENT\n.TP\n.B NO_COLOR\nIf set and not empty, the output has no colours.\n";
  return out + verbatim("EXIT STATUS", app.get_footer());
}

void add_reference(CLI::App& app) {
  const auto shell = std::make_shared<std::string>();
  CLI::App* const completion =
      app.add_subcommand("completion", "Print a completion script for a shell");
  completion->add_option("SHELL", *shell, "Name of the shell")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  completion->footer(
      "Installing ist installs these scripts. Without an installation:\n"
      "Example: ist completion bash > ~/.local/share/bash-completion/completions/ist");
  completion->callback([&app, shell] {
    const auto commands = commands_of(app);
    fmt::print("{}", *shell == "bash"  ? bash_completion(commands)
                     : *shell == "zsh" ? zsh_completion(commands)
                                       : fish_completion(commands));
  });

  const auto folder = std::make_shared<std::string>();
  CLI::App* const manual = app.add_subcommand("manual", "Write the man pages of all commands");
  add_output(manual, *folder, "The folder for ist.1, ist-bake.1, …", Dash::refused);
  manual->footer("Example: ist manual -o man && man man/ist-bake.1");
  manual->callback([&app, folder] { write_manual(app, *folder); });
}

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
