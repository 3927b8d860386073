#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "robots/description/kinematics.h"
#include "robots/description/robot_model.h"

namespace ist {

/// Poses that an SRDF names (`group_state`), in its order: joints that a state does not mention
/// stand as in default_positions(). Joints that the robot lacks are passed over. Throws Error.
std::vector<std::pair<std::string, Positions>> group_states(const RobotModel& robot,
                                                            const std::string& srdf);

/// What an SRDF tells planners to ignore (`disable_collisions`).
struct DisabledCollisions {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;  ///< of links, by index
  std::set<std::string> lacking;  ///< links that it names and the robot lacks
};
/// Throws Error.
DisabledCollisions disabled_collisions(const RobotModel& robot, const std::string& srdf);

}  // namespace ist
