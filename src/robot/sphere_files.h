#pragma once

#include <span>
#include <string>
#include <vector>

#include <ist/cover_spheres.h>

#include "robot/robot_model.h"

// Files in which other tools expect a robot's spheres. Numbers have all their digits: they come
// back as they were.

namespace ist {

/// A link's spheres, in its frame.
struct LinkSpheres {
  std::string link;
  std::vector<CoverSphere> spheres;
};

/// The URDF with every collision of these links replaced by spheres; all else is kept, byte for
/// byte.
std::string urdf_with_spheres(const RobotModel& robot, std::span<const LinkSpheres> links);

/// A URDF of one link that is spheres, for a mesh that belongs to no robot.
std::string urdf_of_spheres(const LinkSpheres& link);

/// cuRobo: collision_spheres, a list of center and radius a link.
std::string curobo_yaml(std::span<const LinkSpheres> links);

/// XRDF 1.0: format, a geometry of spheres, and collision and self_collision that use it. What a
/// robot needs besides (cspace, tool_frames) is not known here.
std::string xrdf(const std::string& robot, std::span<const LinkSpheres> links);

/// MoveIt: an SRDF with a link_sphere_approximation a link.
std::string srdf(const std::string& robot, std::span<const LinkSpheres> links);

}  // namespace ist
