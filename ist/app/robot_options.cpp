#include "app/robot_options.h"

#include <cstdlib>

#include <ist/error.h>

#include "app/file_options.h"

namespace ist::app {

void add_robot_options(CLI::App* command, RobotOptions& options) {
  command
      ->add_option_function<std::vector<std::string>>(
          "--package",
          [&options](const std::vector<std::string>& given) {
            for (const std::string& one : given) {
              const std::size_t equals = one.find('=');
              if (equals == 0 || equals == std::string::npos || equals + 1 == one.size())
                throw CLI::ValidationError("--package", "'" + one + "' is not NAME=DIR");
              options.packages[one.substr(0, equals)] = one.substr(equals + 1);
            }
          },
          "Robots: the folder of package://NAME/…. Repeatable. Default: ROS_PACKAGE_PATH, then the "
          "folders above the URDF")
      ->type_name("NAME=DIR")
      ->expected(1)
      ->take_all();
  command->add_flag("--visual", options.visual,
                    "Robots: use visual shapes instead of collision shapes");
}

void refuse_idle_options(const RobotOptions& options, const std::string& input) {
  if (is_robot_file(input) || (!options.visual && options.packages.empty())) return;
  throw CLI::ValidationError(options.visual ? "--visual" : "--package",
                             "has no effect: '" + input + "' is not a robot (.urdf)");
}

void refuse_no_shapes(const RobotOptions& options, const std::string& input) {
  throw Error(input + (options.visual
                           ? ": no link has a visual shape"
                           : ": no link has a collision shape; --visual uses the visual shapes"));
}

bool is_robot_file(const std::string& path) { return ending_of(path) == ".urdf"; }

PackagePaths package_paths(const std::string& urdf, const RobotOptions& options) {
  const char* const ros_path = std::getenv("ROS_PACKAGE_PATH");
  return {urdf, options.packages, ros_path == nullptr ? "" : ros_path};
}

}  // namespace ist::app
