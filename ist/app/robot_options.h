#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "library/robot_assets.h"

namespace ist::app {

/// Adds --package, --visual and --skip.
void add_robot_options(CLI::App* command, RobotOptions& options);

/// Throws (exit code 2) where options of a robot are given with what is none.
void refuse_idle_options(const RobotOptions& options, const std::string& input);

/// It ends in .urdf. Throws Error for .xacro, which is to be expanded.
bool is_robot_file(const std::string& path);

}  // namespace ist::app
