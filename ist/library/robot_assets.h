#pragma once

#include <nlohmann/json.hpp>

#include "library/job.h"
#include "robots/description/package_paths.h"
#include "robots/description/robot_model.h"

// Assets of a robot: one for each mesh of its links, and an index of the links that use them.

namespace ist {

struct RobotOptions {
  std::map<std::string, std::string> packages;  ///< folders by package
  bool visual = false;
  std::vector<std::string> skipped;   ///< links that are ignored
  std::vector<std::string> repaired;  ///< links that are repaired even if the others are not

  LinkShapes shapes() const { return visual ? LinkShapes::visual : LinkShapes::collision; }
};

/// The robot without the shapes of skipped links. Throws Error, also if no link has a shape of the
/// requested kind.
RobotModel read_robot_for(const RobotOptions& options, const std::string& input);

/// Links with a visual shape but no collision shape, if collision shapes are used.
std::vector<std::string> links_seen_only(const RobotModel& robot, const RobotOptions& options);

/// Throws Error if no link of the robot has that name.
void require_link(const RobotModel& robot, const std::string& name);

/// Packages from the options, the environment and the URDF's location.
PackagePaths package_paths(const std::string& urdf, const RobotOptions& options);

struct RobotAssets {
  std::string name;              ///< of the robot, valid as a file name
  nlohmann::ordered_json index;  ///< docs/json.md
  std::vector<Job> jobs;         ///< an asset each, named PREFIX + link; `mesh` as in the URDF
  std::vector<std::vector<std::string>> links;  ///< of each job; several links may share its asset
};

/// Meshes with the same file, scale and pose share an asset. Boxes, cylinders and spheres become
/// shape descriptions of the command line with a pose. `like`: settings and requirements of the
/// jobs.
RobotAssets robot_assets(const RobotModel& robot, LinkShapes which, const std::string& prefix,
                         const Job& like);

/// Makes a valid file name.
std::string file_name_of(const std::string& name);

}  // namespace ist
