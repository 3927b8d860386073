#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace ist::app {

/// CLI11's help, with lines that end at the terminal's right edge (at column 80 without a terminal,
/// at 100 at most).
class HelpFormat : public CLI::Formatter {
 public:
  HelpFormat();

  std::string make_option(const CLI::Option* option, bool is_positional) const override;
  std::string make_subcommand(const CLI::App* command) const override;
  std::string make_description(const CLI::App* app) const override;
  std::string make_footer(const CLI::App* app) const override;

 private:
  std::size_t width_;
};

}  // namespace ist::app
