#pragma once

#include <cstddef>
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

/// Pairs of links that an SRDF tells planners to ignore (`disable_collisions`); those with links
/// that the robot lacks are passed over. Throws Error.
std::vector<std::pair<std::size_t, std::size_t>> disabled_collisions(const RobotModel& robot,
                                                                     const std::string& srdf);

}  // namespace ist
