#pragma once

#include <span>
#include <string>
#include <vector>

#include <ist/cover_spheres.h>

#include "robots/description/robot_model.h"

// Files in which other tools expect a robot's spheres. Numbers have all their digits: they come
// back as they were.

namespace ist {

/// A link's spheres, in its frame.
struct LinkSpheres {
  std::string link;
  std::vector<CoverSphere> spheres;
  double protrusion = 0;                    ///< [u] none reaches further out of the link
  std::vector<CoverCapsule> capsules = {};  ///< beside the spheres; URDF alone has them
};

struct SelfCollision;

/// The URDF with every collision of these links replaced by spheres; all else is kept, byte for
/// byte, but for relative names of meshes, so that they are found from `folder`, where it will lie
/// ("": beside the robot's file).
std::string urdf_with_spheres(const RobotModel& robot, std::span<const LinkSpheres> links,
                              const std::string& folder = "");

/// A URDF of one link that is spheres, for a mesh that belongs to no robot.
std::string urdf_of_spheres(const LinkSpheres& link);

/// cuRobo: collision_spheres alone, a list of center and radius a link, for a mesh that belongs to
/// no robot.
std::string curobo_spheres(std::span<const LinkSpheres> links);

/// cuRobo 0.8: a whole robot_cfg. `urdf`: the robot's file, seen from where this one will lie.
/// Joints of fingers are locked where the default pose has them.
std::string curobo_robot(const RobotModel& robot, const std::string& urdf,
                         std::span<const LinkSpheres> links, const SelfCollision& self);

/// XRDF 1.0: cspace, tool frames, a geometry of spheres, and collision and self_collision that use
/// it.
std::string xrdf(const RobotModel& robot, std::span<const LinkSpheres> links,
                 const SelfCollision& self);

/// MoveIt: an SRDF with a link_sphere_approximation a link, and disable_collisions.
std::string srdf(const RobotModel& robot, std::span<const LinkSpheres> links,
                 const SelfCollision& self);

}  // namespace ist
