#pragma once

#include "robots/description/robot_model.h"

namespace ist {

/// Reads a robot of MuJoCo (MJCF): bodies, joints, geoms of primitives and meshes, defaults,
/// includes, excluded pairs, and joint equalities of first order, which become mimicry.
///
/// The world is the first link. A body with several joints gets a link without shapes for each but
/// the last. Free joints and slides without a range are taken as fixed, balls as three hinges.
/// Geoms that collide with nothing (contype and conaffinity 0) are visual; planes and height fields
/// are passed over. Meshes are taken as they are, where MuJoCo collides their convex hull. Geoms of
/// other kinds become a LinkFault. Throws Error.
RobotModel read_mjcf(SourceFile file);

}  // namespace ist
