#include "robots/description/robot_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>
#include <utility>

#include <ist/types.h>

#include "mesh/import/text_scanner.h"
#include "mesh/import/xml_document.h"
#include "robots/description/read_mjcf.h"
#include "robots/description/read_sdf.h"

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t kNoElement = XmlDocument::kNone;

/// Decodes the five entities that every XML file may use.
std::string decoded(std::string_view text) {
  constexpr std::array<std::pair<std::string_view, char>, 5> kEntities{
      {{"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}}};
  std::string out;
  while (!text.empty()) {
    const auto entity = std::find_if(kEntities.begin(), kEntities.end(), [&](const auto& e) {
      return text.substr(0, e.first.size()) == e.first;
    });
    out += entity == kEntities.end() ? text.front() : entity->second;
    text.remove_prefix(entity == kEntities.end() ? 1 : entity->first.size());
  }
  return out;
}

class RobotReader {
 public:
  explicit RobotReader(RobotModel& robot) : robot_(robot), xml_(robot.file) {}

  void read() {
    if (xml_[0].name != "robot")
      xml_.fail(0,
                "is not a robot: a URDF begins with <robot name=\"…\">, an MJCF with "
                "<mujoco>, an SDF with <sdf>");
    robot_.name = decoded(xml_.attribute(0, "name"));
    for (std::uint32_t e = xml_[0].first_child; e != kNoElement; e = xml_[e].next_sibling) {
      if (xml_[e].name == "link") read_link(e);
      if (xml_[e].name == "joint") joints_.push_back(e);
      if (xml_[e].name.starts_with("xacro:"))
        xml_.fail(e, "is a macro of xacro, not a URDF. Expand it: xacro IN.xacro -o OUT.urdf");
    }
    if (robot_.links.empty()) xml_.fail(0, "contains no <link>. Add at least one");
    for (const std::uint32_t joint : joints_) read_joint(joint);
    for (std::size_t j = 0; j < joints_.size(); ++j) read_mimic(joints_[j], robot_.joints[j]);
    require_tree();
  }

 private:
  std::string name_of(std::uint32_t element) const {
    const std::string name = decoded(xml_.attribute(element, "name"));
    if (name.empty()) xml_.fail(element, "has no name. Add name=\"…\"");
    if (std::any_of(name.begin(), name.end(),
                    [](char c) { return static_cast<unsigned char>(c) < ' '; }))
      xml_.fail(element, "its name contains control characters. Rename it");
    return name;
  }

  void read_link(std::uint32_t element) {
    RobotLink link;
    link.name = name_of(element);
    if (!link_.emplace(link.name, robot_.links.size()).second)
      xml_.fail(element, "duplicates the link " + in_quotes(link.name) + ". Rename one of them");
    link.begin = xml_[element].offset;
    link.end = xml_[element].end;
    for (std::uint32_t e = xml_[element].first_child; e != kNoElement; e = xml_[e].next_sibling) {
      if (xml_[e].name == "collision") {
        link.collision.push_back(read_placed(e));
        link.collision_bytes.emplace_back(xml_[e].offset, xml_[e].end);
      } else if (xml_[e].name == "visual") {
        try {
          link.visual.push_back(read_placed(e));
        } catch (const Error& error) {  // most robots are never read by these shapes
          link.visual.emplace_back().shape = LinkFault{error.what()};
        }
      }
    }
    robot_.links.push_back(std::move(link));
  }

  std::pair<Eigen::Quaterniond, Vector3d> read_origin(std::uint32_t element) const {
    const std::uint32_t origin = xml_.child(element, "origin");
    if (origin == kNoElement) return {Eigen::Quaterniond::Identity(), Vector3d::Zero()};
    const Vector3d rpy = vector(origin, "rpy", Vector3d::Zero());
    return {Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) *
                Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
                Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX()),
            vector(origin, "xyz", Vector3d::Zero())};
  }

  PlacedLinkShape read_placed(std::uint32_t element) const {
    PlacedLinkShape placed;
    const auto& bytes = robot_.file.bytes;
    placed.line = 1 + static_cast<std::size_t>(std::count(
                          bytes.begin(),
                          bytes.begin() + static_cast<std::ptrdiff_t>(xml_[element].offset), '\n'));
    std::tie(placed.rotation, placed.translation) = read_origin(element);
    const std::uint32_t geometry = xml_.child(element, "geometry");
    const std::uint32_t shape = geometry == kNoElement ? kNoElement : xml_[geometry].first_child;
    if (shape == kNoElement) xml_.fail(element, "has no <geometry> with a shape. Add one");
    placed.shape = read_shape(shape);
    return placed;
  }

  LinkShape read_shape(std::uint32_t e) const {
    const std::string_view kind = xml_[e].name;
    if (kind == "mesh") {
      LinkMesh mesh;
      const std::string_view name = xml_.attribute(e, "filename");
      mesh.file = decoded(name);
      if (!name.empty()) {
        mesh.name_begin = static_cast<std::size_t>(name.data() - robot_.file.bytes.data());
        mesh.name_end = mesh.name_begin + name.size();
      }
      if (mesh.file.empty()) xml_.fail(e, "has no file. Add filename=\"…\"");
      mesh.scale = vector(e, "scale", Vector3d::Ones());
      if ((mesh.scale.array() == 0).any())
        xml_.fail(e, "a scale of 0 makes the mesh flat. Use nonzero factors, e.g. scale=\"1 1 1\"");
      return mesh;
    }
    if (kind == "box") return LinkBox{0.5 * lengths(e, "size")};
    if (kind == "cylinder") return LinkCylinder{length(e, "radius"), 0.5 * length(e, "length")};
    if (kind == "sphere") return LinkBall{length(e, "radius")};
    if (kind == "capsule") return LinkCapsule{length(e, "radius"), 0.5 * length(e, "length")};
    xml_.fail(e, "is an unknown shape. Use mesh, box, cylinder, sphere or capsule");
  }

  /// Finite numbers, as many as there are places.
  template <std::size_t N>
  std::array<double, N> numbers(std::uint32_t e, std::string_view name,
                                std::string_view text) const {
    std::array<double, N> values{};
    std::size_t count = 0;
    for_words(text, [&](std::string_view word) {
      const std::optional<double> value = parse_real(word);
      if (!value || !std::isfinite(*value) || std::abs(*value) > kLargest)
        xml_.fail(e, std::string(name) + ": " + in_quotes(word) +
                         " is not a finite number of at most 1e100");
      if (count < N) values[count] = *value;
      ++count;
    });
    if (count != N)
      xml_.fail(e, std::string(name) + " has " + std::to_string(count) + " numbers, not " +
                       std::to_string(N));
    return values;
  }

  Vector3d vector(std::uint32_t e, std::string_view name, const Vector3d& otherwise) const {
    const std::string_view text = xml_.attribute(e, name);
    if (text.empty()) return otherwise;
    const std::array<double, 3> v = numbers<3>(e, name, text);
    return {v[0], v[1], v[2]};
  }

  void require_length(std::uint32_t e, std::string_view name, double value) const {
    if (!(value > 0)) xml_.fail(e, std::string(name) + " must be above 0");
  }
  Vector3d lengths(std::uint32_t e, std::string_view name) const {
    const std::array<double, 3> v = numbers<3>(e, name, xml_.attribute(e, name));
    for (const double x : v) require_length(e, name, x);
    return {v[0], v[1], v[2]};
  }
  double real(std::uint32_t e, std::string_view name, double otherwise) const {
    const std::string_view text = xml_.attribute(e, name);
    return text.empty() ? otherwise : numbers<1>(e, name, text)[0];
  }
  double length(std::uint32_t e, std::string_view name) const {
    const double value = numbers<1>(e, name, xml_.attribute(e, name))[0];
    require_length(e, name, value);
    return value;
  }

  std::size_t end_of(std::uint32_t joint, std::string_view which) const {
    const std::uint32_t e = xml_.child(joint, which);
    const std::string name = e == kNoElement ? "" : decoded(xml_.attribute(e, "link"));
    const auto found = link_.find(name);
    if (found == link_.end())
      xml_.fail(joint, "its " + std::string(which) + " " + in_quotes(name) + " is not a link");
    return found->second;
  }

  void read_joint(std::uint32_t e) {
    RobotJoint joint;
    joint.name = decoded(xml_.attribute(e, "name"));
    joint.child = end_of(e, "child");
    joint.parent = end_of(e, "parent");
    const auto [rotation, translation] = read_origin(e);
    joint.origin = Eigen::Translation3d(translation) * rotation;
    const std::string_view type = xml_.attribute(e, "type");
    if (type == "revolute" || type == "continuous") {
      joint.motion = RobotJoint::Motion::turning;
    } else if (type == "prismatic") {
      joint.motion = RobotJoint::Motion::sliding;
    } else if (type != "fixed" && type != "floating" && type != "planar") {
      xml_.fail(e, "its type " + in_quotes(type) +
                       " is unknown. Use fixed, revolute, continuous, prismatic, floating or "
                       "planar");
    } else {
      joint.taken_as_fixed = type != "fixed";
    }
    if (joint.motion != RobotJoint::Motion::fixed) read_motion(e, type == "continuous", joint);
    if (!joint_.emplace(joint.name, robot_.joints.size()).second)
      xml_.fail(e, "duplicates the joint " + in_quotes(joint.name) + ". Rename one of them");
    robot_.joints.push_back(std::move(joint));
  }

  void read_motion(std::uint32_t e, bool endless, RobotJoint& joint) const {
    name_of(e);
    if (const std::uint32_t axis = xml_.child(e, "axis"); axis != kNoElement)
      joint.axis = vector(axis, "xyz", Vector3d::UnitX());
    if (joint.axis.norm() == 0) xml_.fail(e, "its axis has the length 0");
    joint.axis.normalize();
    joint.lower = -std::numbers::pi;
    joint.upper = std::numbers::pi;
    const std::uint32_t limit = xml_.child(e, "limit");
    if (endless) return;
    if (limit == kNoElement) xml_.fail(e, "has no <limit>. Add lower=\"…\" and upper=\"…\"");
    joint.lower = real(limit, "lower", 0);
    joint.upper = real(limit, "upper", 0);
    if (joint.lower > joint.upper) xml_.fail(limit, "lower is above upper. Exchange them");
  }

  void read_mimic(std::uint32_t e, RobotJoint& joint) const {
    const std::uint32_t mimic = xml_.child(e, "mimic");
    if (mimic == kNoElement || joint.motion == RobotJoint::Motion::fixed) return;
    const std::string name = decoded(xml_.attribute(mimic, "joint"));
    const auto found = joint_.find(name);
    if (found == joint_.end() || xml_.child(joints_[found->second], "mimic") != kNoElement)
      xml_.fail(mimic, in_quotes(name) + " is not a joint that moves on its own");
    joint.mimics = found->second;
    joint.multiplier = real(mimic, "multiplier", 1);
    joint.offset = real(mimic, "offset", 0);
  }

  /// Every link but one is the child of one joint, and none its own ancestor.
  void require_tree() {
    const std::size_t count = robot_.links.size();
    robot_.joint_of.assign(count, kNone);
    std::vector<std::vector<std::size_t>> children(count);
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      const RobotJoint& joint = robot_.joints[j];
      if (robot_.joint_of[joint.child] != kNone)
        xml_.fail(joints_[j], "link " + in_quotes(robot_.links[joint.child].name) +
                                  " already has a parent. A URDF is a tree");
      robot_.joint_of[joint.child] = j;
      children[joint.parent].push_back(joint.child);
    }
    std::vector<std::size_t>& order = robot_.order;
    for (std::size_t i = 0; i < count; ++i)
      if (robot_.joint_of[i] == kNone) order.push_back(i);
    const std::size_t roots = order.size();
    std::vector<bool> reached(count, false);
    for (std::size_t k = 0; k < order.size(); ++k) {
      reached[order[k]] = true;
      order.insert(order.end(), children[order[k]].begin(), children[order[k]].end());
    }
    if (order.size() < count) {
      auto at = static_cast<std::size_t>(std::find(reached.begin(), reached.end(), false) -
                                         reached.begin());
      for (std::size_t k = 0; k < count; ++k) at = robot_.joints[robot_.joint_of[at]].parent;
      xml_.fail(0, "its joints form a cycle through link " + in_quotes(robot_.links[at].name) +
                       ". A URDF is a tree");
    }
    if (roots != 1)
      xml_.fail(0, "has " + std::to_string(roots) +
                       " links without a parent. Connect them by joints: a URDF is one tree");
  }

  static constexpr double kLargest = 1e100;

  RobotModel& robot_;
  const XmlDocument xml_;
  std::map<std::string, std::size_t> link_, joint_;
  std::vector<std::uint32_t> joints_;
};

}  // namespace

RobotModel read_robot(SourceFile file) {
  const std::string root(XmlDocument(file)[0].name);
  if (root == "mujoco") return read_mjcf(std::move(file));
  if (root == "sdf") return read_sdf(std::move(file));
  RobotModel robot;
  robot.file = std::move(file);
  RobotReader(robot).read();
  return robot;
}

RobotModel read_robot(const std::string& path) { return read_robot(read_source_file(path)); }

}  // namespace ist
