#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

#include "robot/package_paths.h"
#include "robot/robot_model.h"

namespace ist::app {

/// How a robot's description is read.
struct RobotOptions {
  std::map<std::string, std::string> packages;  ///< folders by package
  bool visual = false;

  LinkShapes shapes() const { return visual ? LinkShapes::visual : LinkShapes::collision; }
};

/// Adds --package and --visual.
void add_robot_options(CLI::App* command, RobotOptions& options);

/// Throws (exit code 2) where options of a robot are given with what is none.
void refuse_idle_options(const RobotOptions& options, const std::string& input);

/// Throws Error: no link has a shape of the kind that is asked for.
[[noreturn]] void refuse_no_shapes(const RobotOptions& options, const std::string& input);

bool is_robot_file(const std::string& path);  ///< it ends in .urdf

/// Packages as the options, the environment and the URDF's place say.
PackagePaths package_paths(const std::string& urdf, const RobotOptions& options);

}  // namespace ist::app
