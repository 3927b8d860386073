#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "robot/robot_model.h"
#include "robot/sphere_files.h"

namespace ist {

/// Two links whose spheres a planner does not compare with each other.
struct IgnoredPair {
  std::string a, b;    ///< in the order of the file
  const char* reason;  ///< as MoveIt calls it: Adjacent, Always or Default
};

struct SelfCollision {
  std::vector<IgnoredPair> ignored;
  /// [u] ≤ 0, by link: what its spheres are made smaller by where links are compared, so that the
  /// default pose is free. No more than they protrude by. Links that are not there: 0.
  std::map<std::string, double> buffers;
  std::size_t pairs = 0, samples = 0;  ///< of links, and of positions that were tried

  double buffer(const std::string& link) const {
    const auto found = buffers.find(link);
    return found == buffers.end() ? 0 : found->second;
  }
};

/// Which links overlap because of how the robot is built.
///
/// Adjacent: a joint connects them, or links without spheres alone stand between. Always: their
/// spheres overlap in at least 95 % of positions drawn from the joints' limits. Default: they
/// overlap in the default pose by more than their spheres protrude; by less, buffers part them.
/// The same input gives the same answer.
SelfCollision self_collision(const RobotModel& robot, std::span<const LinkSpheres> links);

}  // namespace ist
