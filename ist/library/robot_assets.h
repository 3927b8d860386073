#pragma once

#include <nlohmann/json.hpp>

#include "library/job.h"
#include "robots/description/package_paths.h"
#include "robots/description/robot_model.h"

// Assets of a robot: one for each mesh of its links, and an index that says where they belong.

namespace ist {

/// How a robot's description is read.
struct RobotOptions {
  std::map<std::string, std::string> packages;  ///< folders by package
  bool visual = false;
  std::vector<std::string> skipped;   ///< links that are left out
  std::vector<std::string> repaired;  ///< links that are repaired, though the others are not

  LinkShapes shapes() const { return visual ? LinkShapes::visual : LinkShapes::collision; }
};

/// The robot without the shapes of links that are left out. Throws Error; and if no link has a
/// shape of the kind that is asked for.
RobotModel read_robot_for(const RobotOptions& options, const std::string& input);

/// Links without a collision shape that have a visual one, if it is collision shapes that are used.
std::vector<std::string> links_seen_only(const RobotModel& robot, const RobotOptions& options);

/// Throws Error where no link of the robot has that name.
void require_link(const RobotModel& robot, const std::string& name);

/// Packages as the options, the environment and the URDF's place say.
PackagePaths package_paths(const std::string& urdf, const RobotOptions& options);

struct RobotAssets {
  std::string name;              ///< of the robot, as a file may be called
  nlohmann::ordered_json index;  ///< docs/json.md
  std::vector<Job> jobs;         ///< an asset each, named PREFIX + link; `mesh` as in the URDF
  std::vector<std::vector<std::string>> links;  ///< of each job; more than one share its asset
};

/// Meshes with the same file, scale and pose share an asset. Boxes, cylinders and spheres become
/// field descriptions of the command line with a pose. `like`: settings and demands of the jobs.
RobotAssets robot_assets(const RobotModel& robot, LinkShapes which, const std::string& prefix,
                         const Job& like);

/// A name that a file may have.
std::string file_name_of(const std::string& name);

}  // namespace ist
