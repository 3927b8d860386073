#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <ist/types.h>

#include "mesh/import/text_scanner.h"
#include "mesh/import/xml_document.h"
#include "robots/description/robot_model.h"

namespace ist {

inline constexpr std::uint32_t kNoTag = XmlDocument::kNone;

/// Decodes the five entities that every XML file may use.
inline std::string decoded(std::string_view text) {
  constexpr std::pair<std::string_view, char> kEntities[] = {
      {"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}};
  std::string out;
  while (!text.empty()) {
    const auto* const entity =
        std::find_if(std::begin(kEntities), std::end(kEntities),
                     [&](const auto& e) { return text.starts_with(e.first); });
    const bool found = entity != std::end(kEntities);
    out += found ? entity->second : text.front();
    text.remove_prefix(found ? entity->first.size() : 1);
  }
  return out;
}

/// What is wrong with a name; "" if nothing is.
inline std::string name_fault(std::string_view name) {
  const bool control = std::any_of(name.begin(), name.end(),
                                   [](char c) { return static_cast<unsigned char>(c) < ' '; });
  return control ? "its name contains control characters. Rename it" : "";
}

/// Makes a joint stand at multiplier · (another's position) + offset. All of a chain follow its
/// last. False: the joint would follow itself.
inline bool follow(std::vector<RobotJoint>& joints, std::size_t one, std::size_t by,
                   double multiplier, double offset) {
  if (const RobotJoint& last = joints[by]; last.mimics != kNone) {
    offset += multiplier * last.offset;
    multiplier *= last.multiplier;
    by = last.mimics;
  }
  if (one == by) return false;
  for (RobotJoint& joint : joints)
    if (joint.mimics == one) {
      joint.mimics = by;
      joint.offset += joint.multiplier * offset;
      joint.multiplier *= multiplier;
    }
  joints[one].mimics = by;
  joints[one].offset = offset;
  joints[one].multiplier = multiplier;
  return true;
}

/// What the readers of URDF and SDF share: values, shapes, joints' ends and limits, and the tree of
/// links. An element states a value by name: URDF in an attribute, SDF in a child.
class RobotXml {
 public:
  explicit RobotXml(RobotModel& robot) : robot_(robot), xml_(robot.file) {}

 protected:
  ~RobotXml() = default;

  /// The value of that name; empty if there is none.
  virtual std::string text(std::uint32_t element, std::string_view name) const = 0;

  /// The children of that name, or all.
  std::vector<std::uint32_t> children(std::uint32_t element, std::string_view name = "") const {
    std::vector<std::uint32_t> out;
    for (std::uint32_t e = xml_[element].first_child; e != kNoTag; e = xml_[e].next_sibling)
      if (name.empty() || xml_[e].name == name) out.push_back(e);
    return out;
  }

  std::string name_of(std::uint32_t element) const {
    const std::string name = decoded(xml_.attribute(element, "name"));
    if (name.empty()) xml_.fail(element, "has no name. Add name=\"…\"");
    if (const std::string fault = name_fault(name); !fault.empty()) xml_.fail(element, fault);
    return name;
  }

  /// Reads as many numbers as `otherwise`, which is the default of a missing value.
  std::vector<double> numbers(std::uint32_t e, std::string_view name,
                              std::vector<double> otherwise) const {
    const std::string words = text(e, name);
    return words.empty() ? otherwise : numbers_of(e, name, words, otherwise.size());
  }
  double real(std::uint32_t e, std::string_view name, double otherwise,
              double largest = kLargest) const {
    const std::string words = text(e, name);
    return words.empty() ? otherwise : numbers_of(e, name, words, 1, largest)[0];
  }
  Eigen::Vector3d vector(std::uint32_t e, std::string_view name,
                         const Eigen::Vector3d& otherwise) const {
    const std::vector<double> v = numbers(e, name, {otherwise.x(), otherwise.y(), otherwise.z()});
    return {v[0], v[1], v[2]};
  }
  /// [u] Positive, or an error.
  std::vector<double> lengths(std::uint32_t e, std::string_view name, std::size_t count) const {
    const std::vector<double> values = numbers_of(e, name, text(e, name), count);
    for (const double x : values)
      if (!(x > 0)) xml_.fail(e, std::string(name) + " must be above 0");
    return values;
  }

  static Eigen::Quaterniond turned(double roll, double pitch, double yaw) {
    return Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
           Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
           Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
  }

  std::size_t add_link(const std::string& name, std::uint32_t element) {
    if (!link_.emplace(name, robot_.links.size()).second)
      xml_.fail(element, "duplicates the link " + in_quotes(name) + ". Rename one of them");
    robot_.links.emplace_back().name = name;
    return robot_.links.size() - 1;
  }

  std::size_t link_named(std::uint32_t joint, const std::string& which,
                         const std::string& name) const {
    const auto found = link_.find(name);
    if (found == link_.end())
      xml_.fail(joint, "its " + which + " " + in_quotes(name) + " is not a link");
    return found->second;
  }

  /// The element of a collision's or visual's shape.
  std::uint32_t shape_in(std::uint32_t element) const {
    const std::uint32_t geometry = xml_.child(element, "geometry");
    const std::uint32_t shape = geometry == kNoTag ? kNoTag : xml_[geometry].first_child;
    if (shape == kNoTag) xml_.fail(element, "has no <geometry> with a shape. Add one");
    return shape;
  }

  std::size_t line_of(std::uint32_t element) const {
    const std::string_view before =
        std::string_view(robot_.file.bytes).substr(0, xml_[element].offset);
    return 1 + static_cast<std::size_t>(std::count(before.begin(), before.end(), '\n'));
  }

  /// `file`: of a mesh, and how it is specified.
  LinkShape shape_of(std::uint32_t e, const std::string& file, const std::string& how) const {
    const std::string_view kind = xml_[e].name;
    if (kind == "mesh") {
      if (file.empty()) xml_.fail(e, "has no file. Add " + how);
      LinkMesh mesh;
      mesh.file = file;
      mesh.scale = vector(e, "scale", Eigen::Vector3d::Ones());
      if ((mesh.scale.array() == 0).any())
        xml_.fail(e, "a scale of 0 makes the mesh flat. Use nonzero factors, e.g. scale=\"1 1 1\"");
      return mesh;
    }
    const auto length = [&](std::string_view name) { return lengths(e, name, 1)[0]; };
    if (kind == "box") {
      const std::vector<double> size = lengths(e, "size", 3);
      return LinkBox{0.5 * Eigen::Vector3d(size[0], size[1], size[2])};
    }
    if (kind == "cylinder") return LinkCylinder{length("radius"), 0.5 * length("length")};
    if (kind == "sphere") return LinkBall{length("radius")};
    if (kind == "capsule") return LinkCapsule{length("radius"), 0.5 * length("length")};
    if (kind == "ellipsoid") {
      const std::vector<double> radii = lengths(e, "radii", 3);
      return LinkEllipsoid{{radii[0], radii[1], radii[2]}};
    }
    xml_.fail(e, "is not read. Use mesh, box, cylinder, sphere, capsule or ellipsoid");
  }

  /// `others`: types that are taken as fixed, each after a blank.
  void read_type(std::uint32_t e, std::string_view others, RobotJoint& joint) const {
    const std::string type(xml_.attribute(e, "type"));
    if (type == "revolute" || type == "continuous")
      joint.motion = RobotJoint::Motion::turning;
    else if (type == "prismatic")
      joint.motion = RobotJoint::Motion::sliding;
    else if (type != "fixed" &&
             (type.empty() ||
              (std::string(others) + " ").find(" " + type + " ") == std::string::npos))
      xml_.fail(e, "its type " + in_quotes(type) +
                       " is unknown. Use fixed, revolute, continuous or prismatic");
    else
      joint.taken_as_fixed = type != "fixed";
    joint.lower = joint.motion == RobotJoint::Motion::fixed ? 0 : -std::numbers::pi;
    joint.upper = -joint.lower;
  }

  void take_axis(std::uint32_t e, const Eigen::Vector3d& axis, RobotJoint& joint) const {
    if (axis.norm() == 0) xml_.fail(e, "its axis has the length 0");
    joint.axis = axis.normalized();
  }

  /// `endless`: the value for no limit, and where larger ones are allowed; 0: nowhere.
  std::pair<double, double> limits_of(std::uint32_t limit, double endless) const {
    const double largest = endless > 0 ? HUGE_VAL : kLargest;
    const std::pair out(real(limit, "lower", 0 - endless, largest),
                        real(limit, "upper", endless, largest));
    if (out.first > out.second)
      xml_.fail(limit,
                "lower is above upper. Exchange them, or make a joint continuous that "
                "turns without limits");
    return out;
  }

  void add_joint(std::uint32_t e, RobotJoint joint) {
    if (!joint_.emplace(joint.name, robot_.joints.size()).second)
      xml_.fail(e, "duplicates the joint " + in_quotes(joint.name) + ". Rename one of them");
    robot_.joints.push_back(std::move(joint));
  }

  /// `mimic`: the element that names another joint.
  void read_mimic(std::uint32_t mimic, std::size_t joint) {
    const std::string name = decoded(xml_.attribute(mimic, "joint"));
    const auto found = joint_.find(name);
    if (found == joint_.end())
      xml_.fail(mimic,
                "no joint is called " + in_quotes(name) + ". Name one that moves on its own");
    const double multiplier = real(mimic, "multiplier", 1);
    if (robot_.joints[found->second].taken_as_fixed ||
        !follow(robot_.joints, joint, found->second, multiplier,
                real(mimic, "offset", 0) - multiplier * real(mimic, "reference", 0)))
      xml_.fail(mimic, in_quotes(name) + " is not a joint that moves on its own");
  }

  /// Requires that every link but one is the child of one joint, and none its own ancestor.
  void require_tree(std::uint32_t model) {
    const std::size_t count = robot_.links.size();
    robot_.joint_of.assign(count, kNone);
    std::vector<std::vector<std::size_t>> below(count);
    for (std::size_t j = 0; j < robot_.joints.size(); ++j) {
      const RobotJoint& joint = robot_.joints[j];
      std::size_t& of = robot_.joint_of[joint.child];
      if (of != kNone)
        xml_.fail(model, "link " + in_quotes(robot_.links[joint.child].name) +
                             " is the child of the joints " + in_quotes(robot_.joints[of].name) +
                             " and " + in_quotes(joint.name) +
                             ". A robot is a tree: remove the one that closes a loop");
      of = j;
      below[joint.parent].push_back(joint.child);
    }
    std::vector<std::size_t>& order = robot_.order;
    for (std::size_t i = 0; i < count; ++i)
      if (robot_.joint_of[i] == kNone) order.push_back(i);
    const std::size_t roots = order.size();
    for (std::size_t k = 0; k < order.size(); ++k)
      order.insert(order.end(), below[order[k]].begin(), below[order[k]].end());
    if (order.size() < count) {
      std::size_t at = 0;
      while (std::count(order.begin(), order.end(), at) != 0) ++at;
      for (std::size_t k = 0; k < count; ++k) at = robot_.joints[robot_.joint_of[at]].parent;
      xml_.fail(model, "its joints form a cycle through link " + in_quotes(robot_.links[at].name) +
                           ". A robot is a tree");
    }
    if (roots != 1)
      xml_.fail(model, "has " + std::to_string(roots) +
                           " links without a parent. Connect them by joints: a robot is one tree");
  }

  RobotModel& robot_;
  const XmlDocument xml_;
  std::map<std::string, std::size_t> link_, joint_;

 private:
  static constexpr double kLargest = 1e100;

  std::vector<double> numbers_of(std::uint32_t e, std::string_view name, std::string_view words,
                                 std::size_t count, double largest = kLargest) const {
    std::vector<double> out;
    for_words(words, [&](std::string_view word) {
      const std::optional<double> value = parse_real(word);
      if (!value || !(std::abs(*value) <= largest))
        xml_.fail(e, std::string(name) + ": " + in_quotes(word) +
                         " is not a finite number of at most 1e100");
      out.push_back(*value);
    });
    if (out.size() != count)
      xml_.fail(e, std::string(name) + " has " + std::to_string(out.size()) + " numbers, not " +
                       std::to_string(count));
    return out;
  }
};

}  // namespace ist
