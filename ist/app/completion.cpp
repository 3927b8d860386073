#include <fmt/format.h>
#include <string_view>

#include "app/reference.h"

namespace ist::app {
namespace {

std::string words(const std::vector<CommandReference>& commands) {
  std::string out;
  for (const CommandReference& command : commands) out += (out.empty() ? "" : " ") + command.name;
  return out;
}

/// The help up to its first stop: what fits beside an option. "e.g. 1%" has none.
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

}  // namespace

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

}  // namespace ist::app
