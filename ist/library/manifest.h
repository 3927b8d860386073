#pragma once

#include "library/job.h"
#include "library/robot_assets.h"

namespace ist {

/// A library of assets as a TOML file describes it (docs/library.md).
struct Manifest {
  std::vector<Job> jobs;              ///< by name, sorted; complete where there are no faults
  std::vector<RobotAssets> robots;    ///< whose assets are among the jobs
  std::vector<std::string> faults;    ///< "scene.toml:12: …": all that can be told without baking
  std::vector<std::string> warnings;  ///< alike: what is probably not meant
};

/// Paths in it are relative to its folder. Throws Error where it cannot be read.
Manifest read_manifest(const std::string& path);

}  // namespace ist
