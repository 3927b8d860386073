#include "robots/description/read_sdf.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include <ist/types.h>

#include "mesh/import/text_scanner.h"
#include "mesh/import/xml_document.h"

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t kNoTag = XmlDocument::kNone;
constexpr const char* kWorld = "world";

class SdfReader {
 public:
  explicit SdfReader(RobotModel& robot) : robot_(robot), xml_(robot.file) {}

  void read() {
    const std::uint32_t model = find_model();
    robot_.name = xml_.attribute(model, "name");
    for (const std::uint32_t e : children(model, "")) {
      if (xml_[e].name == "include" || xml_[e].name == "model")
        xml_.fail(e, "is not read. Write its links and joints into the model itself");
      if (xml_[e].name == "link") add_link(name_of(e), e);
    }
    if (robot_.links.empty()) xml_.fail(model, "contains no <link>. Add at least one");
    for (std::size_t i = 0; i < elements_.size(); ++i) read_shapes(elements_[i], robot_.links[i]);
    const std::vector<std::uint32_t> joints = children(model, "joint");
    for (const std::uint32_t e : joints) read_joint(e);
    for (const std::uint32_t e : joints) read_mimic(e);
    find_order(model);
  }

 private:
  std::uint32_t find_model() const {
    std::uint32_t at = 0;
    for (const std::uint32_t world : children(0, "world")) at = world;
    const std::vector<std::uint32_t> models = children(at, "model");
    if (models.size() != 1)
      xml_.fail(at, "has " + std::to_string(models.size()) +
                        " models. A robot is one <model>, with links and joints");
    return models.front();
  }

  /// The children of that name, or all.
  std::vector<std::uint32_t> children(std::uint32_t element, std::string_view name) const {
    std::vector<std::uint32_t> out;
    for (std::uint32_t e = xml_[element].first_child; e != kNoTag; e = xml_[e].next_sibling)
      if (name.empty() || xml_[e].name == name) out.push_back(e);
    return out;
  }

  std::string name_of(std::uint32_t element) const {
    const std::string name(xml_.attribute(element, "name"));
    if (name.empty()) xml_.fail(element, "has no name. Add name=\"…\"");
    return name;
  }

  /// The words of a child's text; empty if there is none.
  std::string text(std::uint32_t element, std::string_view name) const {
    const std::uint32_t e = xml_.child(element, name);
    std::string out;
    if (e != kNoTag)
      for_words(xml_[e].text,
                [&](std::string_view word) { (out += out.empty() ? "" : " ") += word; });
    return out;
  }

  std::vector<double> numbers(std::uint32_t element, std::string_view name,
                              std::vector<double> otherwise) const {
    const std::string words = text(element, name);
    if (words.empty()) return otherwise;
    std::vector<double> out;
    for_words(words, [&](std::string_view word) {
      const std::optional<double> value = parse_real(word);
      if (!value || std::isnan(*value))
        xml_.fail(xml_.child(element, name), in_quotes(word) + " is not a number");
      out.push_back(*value);
    });
    if (out.size() != otherwise.size())
      xml_.fail(xml_.child(element, name), "has " + std::to_string(out.size()) + " numbers, not " +
                                               std::to_string(otherwise.size()));
    return out;
  }

  Vector3d vector(std::uint32_t element, std::string_view name, double otherwise) const {
    const std::vector<double> v = numbers(element, name, {otherwise, otherwise, otherwise});
    for (const double x : v)
      if (!std::isfinite(x)) xml_.fail(element, std::string(name) + " must be finite");
    return {v[0], v[1], v[2]};
  }

  /// [u] Above 0, or an error.
  double length(std::uint32_t element, std::string_view name) const {
    const double value = numbers(element, name, {0})[0];
    if (!(value > 0) || !std::isfinite(value))
      xml_.fail(element, std::string(name) + " must be above 0");
    return value;
  }

  /// The <pose> of an element; `relative_to`: what it is relative to, if the file says so.
  Eigen::Isometry3d pose(std::uint32_t element, std::string& relative_to) const {
    const std::uint32_t e = xml_.child(element, "pose");
    if (e == kNoTag) return Eigen::Isometry3d::Identity();
    relative_to = xml_.attribute(e, "relative_to");
    if (const auto format = xml_.attribute(e, "rotation_format");
        !format.empty() && format != "euler_rpy")
      xml_.fail(e, "its rotation_format is not read. Use x y z roll pitch yaw");
    const double unit = xml_.attribute(e, "degrees") == "true" ? std::numbers::pi / 180 : 1;
    const std::vector<double> v = numbers(element, "pose", {0, 0, 0, 0, 0, 0});
    for (const double x : v)
      if (!std::isfinite(x)) xml_.fail(e, "must be finite");
    return Eigen::Translation3d(v[0], v[1], v[2]) *
           Eigen::AngleAxisd(unit * v[5], Vector3d::UnitZ()) *
           Eigen::AngleAxisd(unit * v[4], Vector3d::UnitY()) *
           Eigen::AngleAxisd(unit * v[3], Vector3d::UnitX());
  }

  std::size_t add_link(const std::string& name, std::uint32_t element) {
    if (!link_.emplace(name, robot_.links.size()).second)
      xml_.fail(element, "duplicates the link " + in_quotes(name) + ". Rename one of them");
    robot_.links.emplace_back().name = name;
    if (element != kNoTag) elements_.push_back(element);
    return robot_.links.size() - 1;
  }

  /// The frame of a link in the model's frame; counts the depth of relative poses.
  Eigen::Isometry3d frame_of(std::size_t link, std::size_t depth = 0) const {
    if (link >= elements_.size()) return Eigen::Isometry3d::Identity();  // the world
    std::string to;
    const Eigen::Isometry3d own = pose(elements_[link], to);
    if (to.empty() || to == "__model__") return own;
    const auto found = link_.find(to);
    if (found == link_.end() || depth > elements_.size())
      xml_.fail(elements_[link], "its pose is relative to " + in_quotes(to) +
                                     ", which is no link with a place of its own");
    return frame_of(found->second, depth + 1) * own;
  }

  void read_shapes(std::uint32_t element, RobotLink& link) const {
    for (const std::uint32_t e : children(element, "")) {
      const bool collides = xml_[e].name == "collision";
      if (!collides && xml_[e].name != "visual") continue;
      const std::uint32_t geometry = xml_.child(e, "geometry");
      const std::uint32_t shape = geometry == kNoTag ? kNoTag : xml_[geometry].first_child;
      if (shape == kNoTag) xml_.fail(e, "has no <geometry> with a shape. Add one");
      const std::string_view kind = xml_[shape].name;
      if (kind == "empty") continue;
      PlacedLinkShape placed;
      const auto& bytes = robot_.file.bytes;
      placed.line = 1 + static_cast<std::size_t>(std::count(
                            bytes.begin(),
                            bytes.begin() + static_cast<std::ptrdiff_t>(xml_[e].offset), '\n'));
      try {
        std::string to;
        const Eigen::Isometry3d at = pose(e, to);
        if (!to.empty() && to != link.name)
          xml_.fail(e, "its pose is relative to " + in_quotes(to) + ", not to its link");
        placed.rotation = Eigen::Quaterniond(at.linear());
        placed.translation = at.translation();
        placed.shape = shape_of(shape);
      } catch (const Error& error) {
        placed.shape = LinkFault{error.what()};
      }
      (collides ? link.collision : link.visual).push_back(std::move(placed));
    }
  }

  LinkShape shape_of(std::uint32_t e) const {
    const std::string_view kind = xml_[e].name;
    if (kind == "mesh") {
      LinkMesh mesh;
      mesh.file = text(e, "uri");
      if (mesh.file.empty()) xml_.fail(e, "has no file. Add <uri>…</uri>");
      if (xml_.child(e, "submesh") != kNoTag)
        xml_.fail(e, "a submesh is not read. Write it into a file of its own");
      mesh.scale = vector(e, "scale", 1);
      if ((mesh.scale.array() == 0).any()) xml_.fail(e, "a scale of 0 makes the mesh flat");
      return mesh;
    }
    if (kind == "box") {
      const Vector3d size = vector(e, "size", 0);
      if (!(size.array() > 0).all()) xml_.fail(e, "size must be above 0");
      return LinkBox{0.5 * size};
    }
    if (kind == "cylinder") return LinkCylinder{length(e, "radius"), 0.5 * length(e, "length")};
    if (kind == "sphere") return LinkBall{length(e, "radius")};
    if (kind == "capsule") return LinkCapsule{length(e, "radius"), 0.5 * length(e, "length")};
    xml_.fail(e, "is not read. Use mesh, box, cylinder, sphere or capsule");
  }

  std::size_t end_of(std::uint32_t joint, const char* which) {
    const std::string name = text(joint, which);
    if (name == kWorld && !link_.contains(kWorld)) return add_link(kWorld, kNoTag);
    const auto found = link_.find(name);
    if (found == link_.end())
      xml_.fail(joint, "its " + std::string(which) + " " + in_quotes(name) + " is not a link");
    return found->second;
  }

  void read_joint(std::uint32_t e) {
    RobotJoint joint;
    joint.name = name_of(e);
    const std::size_t parent = end_of(e, "parent"), child = end_of(e, "child");
    std::string to;
    Eigen::Isometry3d at = pose(e, to);  // in the child's frame, unless it says otherwise
    const Eigen::Isometry3d child_frame = frame_of(child), parent_frame = frame_of(parent);
    if (to == "__model__")
      at = child_frame.inverse() * at;
    else if (!to.empty() && !link_.contains(to))
      xml_.fail(e, "its pose is relative to " + in_quotes(to) + ", which is no link");
    else if (!to.empty())
      at = child_frame.inverse() * frame_of(link_.at(to)) * at;
    joint.parent = parent;
    joint.origin = parent_frame.inverse() * child_frame * at;
    const std::string_view type = xml_.attribute(e, "type");
    if (type == "revolute" || type == "continuous")
      joint.motion = RobotJoint::Motion::turning;
    else if (type == "prismatic")
      joint.motion = RobotJoint::Motion::sliding;
    else if (type != "fixed" && type != "ball" && type != "universal" && type != "revolute2" &&
             type != "screw" && type != "gearbox")
      xml_.fail(e, "its type " + in_quotes(type) +
                       " is unknown. Use fixed, revolute, continuous or "
                       "prismatic");
    else
      joint.taken_as_fixed = type != "fixed";
    if (joint.motion != RobotJoint::Motion::fixed) {
      const std::uint32_t axis = xml_.child(e, "axis");
      if (axis == kNoTag) xml_.fail(e, "has no <axis>. Add one");
      read_axis(axis, type == "continuous", child_frame * at, joint);
    }
    joint_.emplace(joint.name, robot_.joints.size());
    if (at.isApprox(Eigen::Isometry3d::Identity(), 0)) {
      joint.child = child;
      robot_.joints.push_back(joint);
      return;
    }
    joint.child = add_link(joint.name + "_frame", kNoTag);
    RobotJoint rest;
    rest.name = joint.name + "_fixed";
    rest.parent = joint.child;
    rest.child = child;
    rest.origin = at.inverse();
    robot_.joints.push_back(joint);
    robot_.joints.push_back(rest);
  }

  /// `frame`: of the joint in the model.
  void read_axis(std::uint32_t axis, bool endless, const Eigen::Isometry3d& frame,
                 RobotJoint& joint) const {
    if (!text(axis, "xyz").empty()) {
      const std::uint32_t xyz = xml_.child(axis, "xyz");
      joint.axis = vector(axis, "xyz", 0);
      const std::string in(xml_.attribute(xyz, "expressed_in"));
      const bool in_model = in == "__model__" || text(axis, "use_parent_model_frame") == "true" ||
                            text(axis, "use_parent_model_frame") == "1";
      if (in_model)
        joint.axis = frame.linear().transpose() * joint.axis;
      else if (!in.empty() && link_.contains(in))
        joint.axis = frame.linear().transpose() * (frame_of(link_.at(in)).linear() * joint.axis);
      else if (!in.empty() && in != joint.name)
        xml_.fail(xyz, "is expressed in " + in_quotes(in) + ", which is no link");
    } else {
      joint.axis = Vector3d::UnitZ();
    }
    if (joint.axis.norm() == 0) xml_.fail(axis, "has the length 0");
    joint.axis.normalize();
    joint.lower = -std::numbers::pi;
    joint.upper = std::numbers::pi;
    const std::uint32_t limit = xml_.child(axis, "limit");
    const bool slides = joint.motion == RobotJoint::Motion::sliding;
    constexpr double kEndless = 1e15;  // what writers give for no limit at all
    const double lower = limit == kNoTag ? -kEndless : numbers(limit, "lower", {-kEndless})[0];
    const double upper = limit == kNoTag ? kEndless : numbers(limit, "upper", {kEndless})[0];
    if (lower > upper) xml_.fail(limit, "lower is above upper. Exchange them");
    const bool limited = lower > -kEndless && upper < kEndless;
    joint.taken_as_fixed = slides && !limited;  // it has no middle
    if (joint.taken_as_fixed) joint.motion = RobotJoint::Motion::fixed;
    if (endless || !limited) return;
    joint.lower = lower;
    joint.upper = upper;
  }

  void read_mimic(std::uint32_t e) {
    const std::uint32_t axis = xml_.child(e, "axis");
    const std::uint32_t mimic = axis == kNoTag ? kNoTag : xml_.child(axis, "mimic");
    if (mimic == kNoTag) return;
    RobotJoint& joint = robot_.joints[joint_.at(name_of(e))];
    const std::string name(xml_.attribute(mimic, "joint"));
    const auto found = joint_.find(name);
    if (found == joint_.end() || !robot_.joints[found->second].is_free() ||
        found->second == joint_.at(joint.name))
      xml_.fail(mimic, in_quotes(name) + " is not a joint that moves on its own");
    const double reference = numbers(mimic, "reference", {0})[0];
    joint.mimics = found->second;
    joint.multiplier = numbers(mimic, "multiplier", {1})[0];
    joint.offset = numbers(mimic, "offset", {0})[0] - joint.multiplier * reference;
  }

  /// Every link but one is the child of one joint.
  void find_order(std::uint32_t model) {
    robot_.joint_of.assign(robot_.links.size(), kNone);
    for (std::size_t j = 0; j < robot_.joints.size(); ++j) {
      std::size_t& of = robot_.joint_of[robot_.joints[j].child];
      if (of != kNone)
        xml_.fail(model, "link " + in_quotes(robot_.links[robot_.joints[j].child].name) +
                             " is the child of the joints " + in_quotes(robot_.joints[of].name) +
                             " and " + in_quotes(robot_.joints[j].name) +
                             ". A robot is a tree: remove the one that closes a loop");
      of = j;
    }
    for (std::size_t i = 0; i < robot_.links.size(); ++i)
      if (robot_.joint_of[i] == kNone) robot_.order.push_back(i);
    if (robot_.order.size() != 1)
      xml_.fail(model, "has " + std::to_string(robot_.order.size()) +
                           " links without a parent. Connect them by joints: a robot is one tree");
    for (std::size_t k = 0; k < robot_.order.size(); ++k)
      for (const RobotJoint& joint : robot_.joints)
        if (joint.parent == robot_.order[k]) robot_.order.push_back(joint.child);
    if (robot_.order.size() < robot_.links.size())
      xml_.fail(model, "its joints form a cycle. A robot is a tree");
  }

  RobotModel& robot_;
  const XmlDocument xml_;
  std::map<std::string, std::size_t> link_, joint_;
  std::vector<std::uint32_t> elements_;  ///< of the first links: those of the file
};

}  // namespace

RobotModel read_sdf(SourceFile file) {
  RobotModel robot;
  robot.file = std::move(file);
  robot.is_urdf = false;
  SdfReader(robot).read();
  return robot;
}

}  // namespace ist
