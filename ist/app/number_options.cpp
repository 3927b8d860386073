#include "app/number_options.h"

#include <fmt/format.h>

namespace ist::app {

CLI::Option* add_parsed(CLI::App* command, const std::string& name, const std::string& meaning,
                        const std::function<bool(const std::string&)>& take,
                        const std::string& help) {
  return command->add_option_function<std::string>(
      name,
      [name, meaning, take](const std::string& text) {
        if (!take(text))
          throw CLI::ValidationError(name, fmt::format("'{}' is not {}", text, meaning));
      },
      help);
}

CLI::Option* add_real(CLI::App* command, const std::string& name, double& value, const Range& range,
                      const std::string& help) {
  return add_parsed(
             command, name, number_in_words(range),
             [&value, range](const std::string& text) {
               const std::optional<double> parsed = parse_number(text);
               if (!parsed || !range.holds(*parsed)) return false;
               value = *parsed;
               return true;
             },
             help)
      ->type_name("NUMBER")
      ->default_str(fmt::format("{:g}", value));
}

CLI::Option* add_bytes(CLI::App* command, const std::string& name, std::uint64_t& value,
                       const std::string& help) {
  return add_parsed(
             command, name, "a number of bytes such as 4096, 512M or 10G",
             [&value](const std::string& text) {
               const std::optional<std::uint64_t> parsed = parse_bytes(text);
               if (parsed) value = *parsed;
               return parsed.has_value();
             },
             help)
      ->type_name("BYTES");
}

}  // namespace ist::app
