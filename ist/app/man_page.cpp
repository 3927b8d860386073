#include <fmt/format.h>

#include <ist/version.h>
#include "app/reference.h"

namespace ist::app {
namespace {

/// Text that roff takes as it is: hyphens that can be copied, no escapes, no requests.
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

/// Lines as they stand.
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

}  // namespace ist::app
