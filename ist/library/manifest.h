#pragma once

#include "library/job.h"
#include "library/robot_assets.h"

namespace ist {

/// A library of assets described by a TOML file (docs/library.md).
struct Manifest {
  std::vector<Job> jobs;            ///< sorted by name; complete if there are no faults
  std::vector<RobotAssets> robots;  ///< whose assets are among the jobs
  std::vector<std::string> faults;  ///< "scene.toml:12: …": all that can be found without baking
  std::vector<std::string> warnings;  ///< in the same form: probable mistakes
};

/// Paths in it are relative to its folder. Throws Error if it cannot be read.
Manifest read_manifest(const std::string& path);

}  // namespace ist
