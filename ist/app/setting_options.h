#pragma once

#include <CLI/CLI.hpp>
#include <set>
#include <span>
#include <string>

#include "library/settings/bake_settings.h"

namespace ist::app {

/// Settings as options, and the names of those that were given.
struct SettingOptions {
  BakeSettings settings;
  std::set<std::string> given;
};

/// Adds --NAME for each; `options` must outlive the command.
void add_setting_options(CLI::App* command, SettingOptions& options,
                         std::span<const Setting> settings);

/// To be called once all are parsed. Throws (exit code 2) if they do not go together.
void complete_settings(SettingOptions& options);

}  // namespace ist::app
