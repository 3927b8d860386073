#pragma once

#include "robots/description/robot_model.h"

namespace ist {

/// Reads the one model of an SDF: links, joints with limits and mimicry, and shapes of meshes,
/// boxes, cylinders, spheres and capsules.
///
/// A joint whose frame is not its child's gets a link without shapes there, JOINT_frame. A joint to
/// the world makes a link `world`. Balls, screws and joints of two axes are taken as fixed; planes
/// and height maps are passed over, and other shapes become a LinkFault. Nested and included
/// models, and poses relative to frames other than links, are errors. Throws Error.
RobotModel read_sdf(SourceFile file);

}  // namespace ist
