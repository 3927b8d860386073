#pragma once

#include <ist/bake.h>
#include <ist/mesh.h>
#include <CLI/CLI.hpp>

#include "library/robot_assets.h"
#include "library/settings/bake_settings.h"
#include "library/settings/numbers.h"
#include "mesh/import/source_file.h"

// Options that several commands have, and the files that these name. A value that an option does
// not take ends with exit code 2, the option's name and what it takes.

namespace ist::app {

struct SettingOptions {
  BakeSettings settings;
  std::set<std::string> given;
};

/// Adds --NAME for each; `options` must outlive the command.
void add_setting_options(CLI::App* command, SettingOptions& options,
                         std::span<const Setting> settings);

/// To be called once all are parsed. Throws (exit code 2) if they do not go together.
void complete_settings(SettingOptions& options);

void add_robot_options(CLI::App* command, RobotOptions& options);

/// Throws (exit code 2) where options of a robot are given with what is none.
void refuse_idle_options(const RobotOptions& options, const std::string& input);

/// The same where `option` was given.
void refuse_without_robot(const std::string& option, const std::string& input);

/// Whether it ends in .urdf, .sdf, or MuJoCo's .xml or .mjcf. Throws Error for .xacro.
bool is_robot_file(const std::string& path);

/// A required argument or option that names a file to read; "" and "-" are refused.
CLI::Option* add_input(CLI::App* command, const std::string& name, std::string& path,
                       const std::string& help);

/// An option that names such a file, and need not be given.
CLI::Option* add_file(CLI::App* command, const std::string& name, std::string& path,
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

void add_device_option(CLI::App* command, std::string& name, const std::string& help);

/// The device of that name. Throws Error if it is a GPU and there is none to be used.
Device usable_device(const std::string& name);

/// Says where a bake runs, if that was left open.
void announce_device(Device device);

/// An option that refuses what `take` returns false for: "NAME: 'text' is not MEANING".
CLI::Option* add_parsed(CLI::App* command, const std::string& name, const std::string& meaning,
                        const std::function<bool(const std::string&)>& take,
                        const std::string& help);

/// The same for an option that may be given many times; `type`: of its value, for help.
CLI::Option* add_repeated(CLI::App* command, const std::string& name, const std::string& type,
                          const std::string& meaning,
                          const std::function<bool(const std::string&)>& take,
                          const std::string& help);

/// A whole number in [least, most]; `value` holds the default.
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

/// A number in a range, or a share: 0.005 or 0.5%. `value` holds the default.
CLI::Option* add_number(CLI::App* command, const std::string& name, double& value,
                        const Range& range, const std::string& help, bool is_share = false);

CLI::Option* add_bytes(CLI::App* command, const std::string& name,
                       std::optional<std::uint64_t>& value, const std::string& help);

bool has_mesh_ending(const std::string& path);  ///< one that write_mesh() takes

/// Writes a mesh as .obj, .ply (ASCII) or .off with every digit of its doubles, or as .stl (binary;
/// the format itself keeps single precision): its ending decides. Throws Error.
void write_mesh(const TriangleMesh& mesh, const std::string& path);

}  // namespace ist::app
