#include "app/file_options.h"

#include <unistd.h>

#include <cctype>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include <ist/error.h>

#include "bake/asset/atomic_file.h"

namespace ist::app {

CLI::Option* add_input(CLI::App* command, const std::string& name, std::string& path,
                       const std::string& help) {
  return command->add_option(name, path, help)
      ->required()
      ->check([](const std::string& text) -> std::string {
        if (text.empty()) return "'' is not a file name";
        return text == "-" ? "'-' is not accepted: this is not read from standard input; for a "
                             "file named - write ./-"
                           : "";
      });
}

CLI::Option* add_output(CLI::App* command, std::string& path, const std::string& help, Dash dash) {
  return command->add_option("-o,--output", path, help)
      ->required()
      ->check([dash](const std::string& text) -> std::string {
        if (text.empty()) return "'' is not a file name";
        return text == "-" && dash == Dash::refused
                   ? "'-' is not accepted: this is not written to standard output; for a file "
                     "named - write ./-"
                   : "";
      });
}

bool is_standard_output(const std::string& path) { return path == "-"; }

void require_output(const std::string& path, const std::string& input, const std::string& what) {
  namespace fs = std::filesystem;
  if (is_standard_output(path)) return;
  std::error_code none;
  if (fs::equivalent(input, path, none))
    throw Error(path + ": is the input itself; name another file for " + what);
  if (fs::is_directory(path, none))
    throw Error(path + ": is a folder; name a file in it for " + what);
  const fs::path parent = fs::path(path).parent_path();
  const std::string folder = parent.empty() ? "." : parent.string();
  if (!fs::is_directory(folder, none))
    throw Error(path + ": the folder " + folder +
                " does not exist; create it, or name another file");
  if (!fs::exists(path, none) && access(folder.c_str(), W_OK | X_OK) != 0)
    throw Error(path + ": no permission to write to the folder " + folder + "; name another file");
}

void write_text(const std::string& path, std::string_view text) {
  if (!is_standard_output(path)) return write_atomically(path, text);
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size())
    throw Error("standard output: cannot write: " + std::generic_category().message(errno));
}

std::string ending_of(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

}  // namespace ist::app
