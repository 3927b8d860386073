#include "robots/description/kinematics.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "mesh/import/source_file.h"
#include "mesh/import/text_scanner.h"
#include "mesh/import/xml_document.h"
#include "robots/description/robot_xml.h"

namespace ist {
namespace {

using Motion = RobotJoint::Motion;

/// Finds tools from the root towards the leaves.
class Limbs {
 public:
  explicit Limbs(const RobotModel& robot)
      : robot_(robot), children_(robot.links.size()), joints_(robot.links.size(), 0) {
    for (auto link = robot.order.rbegin(); link != robot.order.rend(); ++link) {
      const std::size_t j = robot.joint_of[*link];
      if (j == kNone) continue;
      joints_[robot.joints[j].parent] += joints_with(*link);
      children_[robot.joints[j].parent].push_back(*link);
    }
    for (auto& children : children_) std::sort(children.begin(), children.end());
  }

  /// `before`: moving joints from the root to the link.
  void add_tools(std::size_t link, std::size_t before, std::vector<std::size_t>& tools) const {
    std::vector<std::size_t> limbs;
    for (const std::size_t child : children_[link])
      if (joints_with(child) > 0) limbs.push_back(child);
    if (limbs.empty() && !children_[link].empty())
      return add_tools(children_[link].front(), before, tools);
    const bool hand = limbs.size() > 1 && std::all_of(limbs.begin(), limbs.end(), [&](auto limb) {
                        return joints_with(limb) < before;
                      });
    if (limbs.empty() || hand) return tools.push_back(link);
    for (const std::size_t limb : limbs)
      add_tools(limb, before + joints_with(limb) - joints_[limb], tools);
  }

 private:
  /// Moving joints from the parent of a link to its leaves.
  std::size_t joints_with(std::size_t link) const {
    return joints_[link] + (robot_.joints[robot_.joint_of[link]].motion != Motion::fixed ? 1 : 0);
  }

  const RobotModel& robot_;
  std::vector<std::vector<std::size_t>> children_;
  std::vector<std::size_t> joints_;  ///< moving ones below each link
};

/// Calls `take` with each element of that name below the SRDF's root.
template <typename Take>
void for_each_element(const std::string& srdf, std::string_view name, const Take& take) {
  const SourceFile file = read_source_file(srdf);
  const XmlDocument xml(file);
  if (xml[0].name != "robot") xml.fail(0, "is not an SRDF, which begins with <robot name=\"…\">");
  for (std::uint32_t e = xml[0].first_child; e != XmlDocument::kNone; e = xml[e].next_sibling)
    if (xml[e].name == name) take(xml, e);
}

}  // namespace

Positions default_positions(const RobotModel& robot) {
  Positions positions;
  for (const RobotJoint& joint : robot.joints)
    positions.push_back(
        joint.lower <= 0 && joint.upper >= 0 ? 0 : joint.lower + (joint.upper - joint.lower) / 2);
  return positions;
}

Positions middle_positions(const RobotModel& robot) {
  Positions positions;
  for (const RobotJoint& joint : robot.joints)
    positions.push_back(joint.lower + (joint.upper - joint.lower) / 2);
  return positions;
}

Eigen::Isometry3d joint_frame(const RobotModel& robot, std::size_t j, const Positions& positions) {
  const RobotJoint& joint = robot.joints[j];
  const double position = joint.mimics == kNone
                              ? positions[j]
                              : joint.multiplier * positions[joint.mimics] + joint.offset;
  if (joint.motion == Motion::turning)
    return joint.origin * Eigen::AngleAxisd(position, joint.axis);
  if (joint.motion == Motion::sliding)
    return joint.origin * Eigen::Translation3d(position * joint.axis);
  return joint.origin;
}

std::vector<Eigen::Isometry3d> link_frames(const RobotModel& robot, const Positions& positions) {
  std::vector<Eigen::Isometry3d> frames(robot.links.size(), Eigen::Isometry3d::Identity());
  for (const std::size_t link : robot.order)
    if (const std::size_t j = robot.joint_of[link]; j != kNone)
      frames[link] = frames[robot.joints[j].parent] * joint_frame(robot, j, positions);
  return frames;
}

std::vector<std::size_t> tool_links(const RobotModel& robot) {
  std::vector<std::size_t> tools;
  Limbs(robot).add_tools(robot.order.front(), 0, tools);
  return tools;
}

std::vector<std::size_t> path_to(const RobotModel& robot, std::size_t link) {
  std::vector<std::size_t> path;
  for (std::size_t j = robot.joint_of[link]; j != kNone; j = robot.joint_of[robot.joints[j].parent])
    path.push_back(j);
  std::reverse(path.begin(), path.end());
  return path;
}

std::vector<std::size_t> gripper_joints(const RobotModel& robot) {
  constexpr std::size_t kMost = 2;
  std::vector<std::size_t> joints;
  for (const std::size_t tool : tool_links(robot)) {
    std::vector<std::size_t> own;
    for (std::size_t j = 0; j < robot.joints.size(); ++j) {
      const std::vector<std::size_t> path = path_to(robot, robot.joints[j].child);
      if (robot.joints[j].is_free() && std::any_of(path.begin(), path.end(), [&](std::size_t up) {
            return robot.joints[up].parent == tool;
          }))
        own.push_back(j);
    }
    if (own.size() <= kMost) joints.insert(joints.end(), own.begin(), own.end());
  }
  return joints;
}

GroupStates group_states(const RobotModel& robot, const std::string& srdf) {
  constexpr double kRounded = 1e-3;  // [rad or u]
  GroupStates out;
  for_each_element(srdf, "group_state", [&](const XmlDocument& xml, std::uint32_t e) {
    Positions positions = default_positions(robot);
    bool any = false, within = true;
    for (std::uint32_t j = xml[e].first_child; j != XmlDocument::kNone; j = xml[j].next_sibling) {
      const std::size_t joint = index_named(robot.joints, decoded(xml.attribute(j, "name")));
      if (xml[j].name != "joint" || joint == robot.joints.size() || !robot.joints[joint].is_free())
        continue;
      const std::optional<double> value = parse_real(xml.attribute(j, "value"));
      if (!value || !std::isfinite(*value)) xml.fail(j, "its value is not a finite number");
      any = true;
      positions[joint] = std::clamp(*value, robot.joints[joint].lower, robot.joints[joint].upper);
      within = within && std::abs(positions[joint] - *value) <= kRounded;
    }
    const std::string name = decoded(xml.attribute(e, "name"));
    if (any && within)
      out.poses.emplace_back(name, std::move(positions));
    else
      out.unfit.insert(name);
  });
  return out;
}

DisabledCollisions disabled_collisions(const RobotModel& robot, const std::string& srdf) {
  DisabledCollisions out;
  for_each_element(srdf, "disable_collisions", [&](const XmlDocument& xml, std::uint32_t e) {
    const auto link = [&](const char* which) {
      const std::string name = decoded(xml.attribute(e, which));
      const std::size_t at = index_named(robot.links, name);
      if (at == robot.links.size()) out.lacking.insert(name);
      return at;
    };
    const std::size_t a = link("link1"), b = link("link2");
    if (std::max(a, b) < robot.links.size()) out.pairs.emplace_back(a, b);
  });
  return out;
}

}  // namespace ist
