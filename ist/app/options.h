#pragma once

#include <ist/bake.h>
#include <ist/mesh.h>
#include <CLI/CLI.hpp>

#include "library/robot_assets.h"
#include "library/settings/bake_settings.h"
#include "library/settings/numbers.h"
#include "mesh/import/source_file.h"

// Options shared by several commands, and the files that they name. An invalid value ends with exit
// code 2, the option's name and the valid values.

namespace ist::app {

struct SettingOptions {
  BakeSettings settings;
  std::set<std::string> given;
};

/// Adds --NAME for each; `options` must outlive the command.
void add_setting_options(CLI::App* command, SettingOptions& options,
                         std::span<const Setting> settings);

/// Call after all options are parsed. Throws (exit code 2) if they are inconsistent.
void complete_settings(SettingOptions& options);

void add_robot_options(CLI::App* command, RobotOptions& options);

/// Throws (exit code 2) if options for robots are given with another input.
void refuse_idle_options(const RobotOptions& options, const std::string& input);

/// The same if `option` was given.
void refuse_without_robot(const std::string& option, const std::string& input);

/// True if the name ends in .urdf, .sdf, or MuJoCo's .xml or .mjcf. Throws Error for .xacro.
bool is_robot_file(const std::string& path);

/// A required argument or option that names a file to read; "" and "-" are refused.
CLI::Option* add_input(CLI::App* command, const std::string& name, std::string& path,
                       const std::string& help);

/// An optional option that names such a file.
CLI::Option* add_file(CLI::App* command, const std::string& name, std::string& path,
                      const std::string& help);

/// The meaning of "-" as an output.
enum class Dash { refused, standard_output };

/// The required option -o,--output; "" is refused, and "-" unless it means standard output.
CLI::Option* add_output(CLI::App* command, std::string& path, const std::string& help, Dash dash);

bool is_standard_output(const std::string& path);

/// Throws Error if a file cannot be created at `path`, or is `input` itself: called before the
/// work. `what`: the purpose of the file, e.g. "the asset".
void require_output(const std::string& path, const std::string& input, const std::string& what);

/// Writes the whole file, or nothing; "-" is standard output. Throws Error.
void write_text(const std::string& path, std::string_view text);

void add_device_option(CLI::App* command, std::string& name, const std::string& help);

/// The device of that name. Throws Error if it is a GPU that cannot be used.
Device usable_device(const std::string& name);

/// Reports where a bake runs, if the settings left it open.
void announce_device(Device device);

/// An option that refuses values for which `take` returns false: "NAME: 'text' is not MEANING".
CLI::Option* add_parsed(CLI::App* command, const std::string& name, const std::string& meaning,
                        const std::function<bool(const std::string&)>& take,
                        const std::string& help);

/// The same for an option that may be given many times; `type`: of its value, for help.
CLI::Option* add_repeated(CLI::App* command, const std::string& name, const std::string& type,
                          const std::string& meaning,
                          const std::function<bool(const std::string&)>& take,
                          const std::string& help);

/// An integer in [least, most]; `value` contains the default.
template <class T>
CLI::Option* add_whole(CLI::App* command, const std::string& name, T& value,
                       const std::string& help, T least = 0,
                       T most = std::numeric_limits<T>::max()) {
  const std::string range = std::to_string(least) + " to " + std::to_string(most);
  return add_parsed(
             command, name, "a whole number from " + range,
             [&value, least, most](const std::string& text) {
               return take_whole(text, least, most, value);
             },
             help)
      ->type_name("INT")
      ->default_str(std::to_string(value));
}

/// A number in a range, or a share: 0.005 or 0.5%. `value` contains the default.
CLI::Option* add_number(CLI::App* command, const std::string& name, double& value,
                        const Range& range, const std::string& help, bool is_share = false);

CLI::Option* add_bytes(CLI::App* command, const std::string& name,
                       std::optional<std::uint64_t>& value, const std::string& help);

bool has_mesh_ending(const std::string& path);  ///< an extension that write_mesh() supports

/// Writes a mesh as .obj, .ply (ASCII) or .off with all digits of its doubles, or as .stl (binary;
/// the format has single precision), chosen by its extension. Throws Error.
void write_mesh(const TriangleMesh& mesh, const std::string& path);

}  // namespace ist::app
