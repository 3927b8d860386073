#pragma once

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

}  // namespace ist
