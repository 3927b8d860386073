#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>

// File names on the command line, and where text goes that may go to standard output.

namespace ist::app {

/// A required argument or option that names a file to read; "" and "-" are refused.
CLI::Option* add_input(CLI::App* command, const std::string& name, std::string& path,
                       const std::string& help);

/// Whether "-" may stand for standard output.
enum class Dash { refused, standard_output };

/// The required option -o,--output; "" is refused, and "-" where it stands for nothing.
CLI::Option* add_output(CLI::App* command, std::string& path, const std::string& help, Dash dash);

bool is_standard_output(const std::string& path);

/// Throws Error if a file cannot be made at `path`, or is `input` itself: before the work, not
/// after it. `what`: what the file is for, "the asset".
void require_output(const std::string& path, const std::string& input, const std::string& what);

/// The whole file, or not at all; "-" is standard output. Throws Error.
void write_text(const std::string& path, std::string_view text);

/// What a file name ends in, in small letters: ".csv" of "A.CSV".
std::string ending_of(const std::string& path);

}  // namespace ist::app
