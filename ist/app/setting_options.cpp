#include "app/setting_options.h"

#include "app/number_options.h"

namespace ist::app {

void add_setting_options(CLI::App* command, SettingOptions& options,
                         std::span<const Setting> settings) {
  for (const Setting& setting : settings) {
    const std::string name = "--" + setting.name;
    const auto take = [&options, &setting](const std::string& text) {
      options.given.insert(setting.name);
      return setting.take(options.settings, text);
    };
    if (setting.kind == SettingKind::flag)
      command->add_flag_callback(
          name, [take] { take("true"); }, setting.help);
    else
      add_parsed(command, name, setting.meaning, take, setting.help)
          ->type_name(setting.type)
          ->default_str(setting.fallback);
  }
}

void complete_settings(SettingOptions& options) {
  if (const auto fault = complete(options.settings, options.given, options.given, "--"))
    throw CLI::ValidationError("--" + fault->name, fault->what);
}

}  // namespace ist::app
