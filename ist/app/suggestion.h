#pragma once

#include <CLI/CLI.hpp>
#include <span>
#include <string>

namespace ist::app {

/// For a command line that was refused: the command or the option that its first unknown word was
/// probably meant to be. Empty if there is none.
std::string suggestion(const CLI::App& app, std::span<char* const> arguments);

}  // namespace ist::app
