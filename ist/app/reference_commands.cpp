#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <system_error>

#include <ist/error.h>

#include "app/commands.h"
#include "app/file_options.h"
#include "app/interrupt.h"
#include "app/reference.h"

namespace ist::app {
namespace {

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

}  // namespace

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

}  // namespace ist::app
