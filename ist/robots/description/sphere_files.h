#pragma once

#include <span>
#include <string>
#include <vector>

#include <ist/cover_spheres.h>

#include "robots/description/robot_model.h"

// Files of a robot's spheres for other tools. Numbers have all their digits, so they read back
// exactly.

namespace ist {

/// A link's spheres, in its frame.
struct LinkSpheres {
  std::string link;
  std::vector<CoverSphere> spheres;
  double protrusion = 0;                    ///< [u] bound on the protrusion
  std::vector<CoverCapsule> capsules = {};  ///< in addition to the spheres; only URDF supports them
};

struct SelfCollision;

/// The URDF with every collision of these links replaced by spheres; everything else is kept, byte
/// for byte, except relative names of meshes, which are rewritten relative to `folder`, the new
/// file's place ("": beside the robot's file).
std::string urdf_with_spheres(const RobotModel& robot, std::span<const LinkSpheres> links,
                              const std::string& folder = "");

/// A URDF of a single link made of spheres, for a mesh without a robot.
std::string urdf_of_spheres(const LinkSpheres& link);

/// cuRobo: collision_spheres alone, a list of center and radius for each link, for a mesh without a
/// robot.
std::string curobo_spheres(std::span<const LinkSpheres> links);

/// cuRobo 0.8: a whole robot_cfg. `urdf`: the path of the robot's file from this file. Joints of
/// fingers are locked in the default pose.
std::string curobo_robot(const RobotModel& robot, const std::string& urdf,
                         std::span<const LinkSpheres> links, const SelfCollision& self);

/// XRDF 1.0: cspace, tool frames, a geometry of spheres, and collision and self_collision that use
/// it.
std::string xrdf(const RobotModel& robot, std::span<const LinkSpheres> links,
                 const SelfCollision& self);

/// MoveIt: an SRDF with one link_sphere_approximation per link, and disable_collisions.
std::string srdf(const RobotModel& robot, std::span<const LinkSpheres> links,
                 const SelfCollision& self);

}  // namespace ist
