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

namespace {

CLI::Option* add_number(CLI::App* command, const std::string& name, double& value,
                        const Range& range, const std::string& words,
                        std::optional<double> (*parse)(std::string_view), const std::string& help) {
  return add_parsed(
             command, name, words,
             [&value, range, parse](const std::string& text) {
               const std::optional<double> parsed = parse(text);
               if (!parsed || !range.holds(*parsed)) return false;
               value = *parsed;
               return true;
             },
             help)
      ->type_name("NUMBER")
      ->default_str(fmt::format("{:g}", value));
}

}  // namespace

CLI::Option* add_real(CLI::App* command, const std::string& name, double& value, const Range& range,
                      const std::string& help) {
  return add_number(command, name, value, range, number_in_words(range), parse_number, help);
}

CLI::Option* add_share(CLI::App* command, const std::string& name, double& value,
                       const Range& range, const std::string& help) {
  return add_number(command, name, value, range, share_in_words(range), parse_share, help);
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
