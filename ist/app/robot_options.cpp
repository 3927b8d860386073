#include "app/robot_options.h"

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
  command->add_option("--skip", options.skipped, "Robots: leave this link out. Repeatable")
      ->type_name("LINK")
      ->expected(1)
      ->take_all();
}

void refuse_idle_options(const RobotOptions& options, const std::string& input) {
  if (is_robot_file(input)) return;
  if (!options.visual && options.packages.empty() && options.skipped.empty()) return;
  throw CLI::ValidationError(options.visual             ? "--visual"
                             : options.packages.empty() ? "--skip"
                                                        : "--package",
                             "has no effect: '" + input + "' is not a robot (.urdf)");
}

bool is_robot_file(const std::string& path) {
  const std::string ending = ending_of(path);
  if (ending == ".xacro")
    throw Error(path + ": is a macro file, not a URDF; expand it: xacro " + path +
                " -o robot.urdf");
  return ending == ".urdf";
}

}  // namespace ist::app
