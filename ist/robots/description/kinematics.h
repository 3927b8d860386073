#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "robots/description/robot_model.h"

namespace ist {

/// A position of each joint; those of fixed joints and mimics are ignored.
using Positions = std::vector<double>;

/// 0 if the joint's limits allow it, else the middle between them.
Positions default_positions(const RobotModel& robot);

Positions middle_positions(const RobotModel& robot);

/// The frame of the joint's child in its parent's frame.
Eigen::Isometry3d joint_frame(const RobotModel& robot, std::size_t joint,
                              const Positions& positions);

/// Frames of all links in the root's frame.
std::vector<Eigen::Isometry3d> link_frames(const RobotModel& robot, const Positions& positions);

/// Links that carry tools, the main one first: the last fixed link behind the joints of each limb.
/// A limb ends before a hand: where it forks into limbs with fewer moving joints than lead there.
std::vector<std::size_t> tool_links(const RobotModel& robot);

std::vector<std::size_t> path_to(const RobotModel& robot, std::size_t link);

/// Free joints of grippers: hands with at most two joints.
std::vector<std::size_t> gripper_joints(const RobotModel& robot);

/// Poses that an SRDF names (`group_state`), in its order: joints that a state does not mention
/// stand as in default_positions(). Joints that the robot lacks are passed over.
struct GroupStates {
  std::vector<std::pair<std::string, Positions>> poses;
  std::set<std::string> unfit;  ///< those with no joint of the robot, or one beyond its limits
};
/// Throws Error.
GroupStates group_states(const RobotModel& robot, const std::string& srdf);

/// The pairs that planners ignore according to an SRDF (`disable_collisions`).
struct DisabledCollisions {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;  ///< of links, by index
  std::set<std::string> lacking;  ///< links that it names and the robot lacks
};
/// Throws Error.
DisabledCollisions disabled_collisions(const RobotModel& robot, const std::string& srdf);

}  // namespace ist
