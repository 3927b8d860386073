#pragma once

#include <string>

#include <ist/bake.h>

#include "app/robot_options.h"
#include "library/settings/bake_settings.h"

namespace ist::app {

/// What `ist bake robot.urdf -o out/` is asked.
struct RobotBake {
  std::string robot;      ///< the URDF
  std::string folder;     ///< for an asset a mesh and the index NAME.json; made if it is not there
  BakeSettings settings;  ///< of each asset; of its mesh repair and wrap alone are looked at
  RobotOptions options;
  bool json = false, quiet = false;
};

/// Bakes every mesh of every link, in the link's frame, and writes assets and the index, all or
/// nothing: files are written once the last bake is done. Boxes, cylinders and spheres become field
/// descriptions of the command line with a pose. Throws Error.
void bake_robot(const RobotBake& what);

}  // namespace ist::app
