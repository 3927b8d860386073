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
  std::vector<std::string> skipped;  ///< links that are left out

  LinkShapes shapes() const { return visual ? LinkShapes::visual : LinkShapes::collision; }
};

/// Adds --package, --visual and --skip.
void add_robot_options(CLI::App* command, RobotOptions& options);

/// Throws (exit code 2) where options of a robot are given with what is none.
void refuse_idle_options(const RobotOptions& options, const std::string& input);

/// The robot without the shapes of links that are left out. Throws Error; and if no link has a
/// shape of the kind that is asked for.
RobotModel read_robot_for(const RobotOptions& options, const std::string& input);

/// Throws Error where no link of the robot has that name.
void require_link(const RobotModel& robot, const std::string& name);

/// It ends in .urdf. Throws Error for .xacro, which is to be expanded.
bool is_robot_file(const std::string& path);

/// Packages as the options, the environment and the URDF's place say.
PackagePaths package_paths(const std::string& urdf, const RobotOptions& options);

}  // namespace ist::app
