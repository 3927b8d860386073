#include "app/options.h"

#include <fmt/format.h>
#include <ist/gpu.h>
#include <spdlog/spdlog.h>
#include <unistd.h>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <set>
#include <system_error>
#include <tuple>

#include "bake/asset/atomic_file.h"

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

CLI::Option* add_repeated(CLI::App* command, const std::string& name, const std::string& type,
                          const std::string& meaning,
                          const std::function<bool(const std::string&)>& take,
                          const std::string& help) {
  return command
      ->add_option_function<std::vector<std::string>>(
          name,
          [name, meaning, take](const std::vector<std::string>& given) {
            std::set<std::string> names;
            for (const std::string& one : given) {
              if (!take(one))
                throw CLI::ValidationError(name, fmt::format("'{}' is not {}", one, meaning));
              const std::size_t equals = one.rfind('=');
              if (!names.insert(equals == std::string::npos ? "" : one.substr(0, equals)).second)
                throw CLI::ValidationError(name,
                                           fmt::format("'{}': the same was given before", one));
            }
          },
          help)
      ->type_name(type)
      ->expected(1)
      ->take_all();
}

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

void add_robot_options(CLI::App* command, RobotOptions& options) {
  add_repeated(
      command, "--package", "NAME=DIR", "NAME=DIR",
      [&options](const std::string& one) {
        const std::size_t equals = one.find('=');
        if (equals == 0 || equals == std::string::npos || equals + 1 == one.size()) return false;
        options.packages[one.substr(0, equals)] = one.substr(equals + 1);
        return true;
      },
      "Robots: the folder of package://NAME/…. Repeatable. Default: ROS_PACKAGE_PATH, then the "
      "folders above the URDF");
  command->add_flag("--visual", options.visual,
                    "Robots: use visual shapes instead of collision shapes");
  for (const auto& [name, links, help] :
       {std::tuple("--skip", &options.skipped, "Robots: leave this link out. Repeatable"),
        std::tuple("--repair-link", &options.repaired,
                   "Robots: as --repair, for this link alone. Repeatable")})
    command->add_option(name, *links, help)->type_name("LINK")->expected(1)->take_all();
}

void refuse_idle_options(const RobotOptions& options, const std::string& input) {
  const char* const given = options.visual              ? "--visual"
                            : !options.packages.empty() ? "--package"
                            : !options.skipped.empty()  ? "--skip"
                            : !options.repaired.empty() ? "--repair-link"
                                                        : nullptr;
  if (given != nullptr) refuse_without_robot(given, input);
}

void refuse_without_robot(const std::string& option, const std::string& input) {
  if (!is_robot_file(input))
    throw CLI::ValidationError(option,
                               "has no effect: '" + input + "' is not a robot (.urdf, .xml, .sdf)");
}

bool is_robot_file(const std::string& path) {
  const std::string ending = ending_of(path);
  if (ending == ".xacro")
    throw Error(path + ": is a macro file, not a URDF; expand it: xacro " + path +
                " -o robot.urdf");
  return ending == ".urdf" || ending == ".xml" || ending == ".mjcf" || ending == ".sdf";
}

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

CLI::Option* add_file(CLI::App* command, const std::string& name, std::string& path,
                      const std::string& help) {
  return add_input(command, name, path, help)->required(false)->type_name("FILE");
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

void add_device_option(CLI::App* command, std::string& name, const std::string& help) {
  command->add_option("--device", name, help)
      ->check(CLI::IsMember({"auto", "cpu", "cuda"}))
      ->capture_default_str();
}

Device usable_device(const std::string& name) {
  if (name == "cpu") return Device::cpu;
  if (name == "auto") return Device::automatic;
  std::string why;
  if (!gpu_available(0, &why)) throw Error("--device cuda: " + why + "; --device cpu needs no GPU");
  return Device::cuda;
}

void announce_device(Device device) {
  if (device != Device::automatic) return;
  std::string why;
  if (gpu_available(0, &why))
    spdlog::info("baking on the GPU: {}", gpu_info().name);
  else
    spdlog::info("baking on the CPU: {}", why);
}

CLI::Option* add_number(CLI::App* command, const std::string& name, double& value,
                        const Range& range, const std::string& help, bool is_share) {
  return add_parsed(
             command, name, in_words(range, is_share),
             [&value, range, is_share](const std::string& text) {
               return take_number(text, range, is_share, value);
             },
             help)
      ->type_name("NUMBER")
      ->default_str(fmt::format("{:g}", value));
}

CLI::Option* add_bytes(CLI::App* command, const std::string& name,
                       std::optional<std::uint64_t>& value, const std::string& help) {
  return add_parsed(
             command, name, "a number of bytes such as 4096, 512M or 10G",
             [&value](const std::string& text) {
               value = parse_bytes(text);
               return value.has_value();
             },
             help)
      ->type_name("BYTES");
}

}  // namespace ist::app
