#include "robots/description/robot_model.h"

#include <numbers>
#include <tuple>
#include <utility>

#include "robots/description/robot_xml.h"

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr const char* kWorld = "world";

class SdfReader final : RobotXml {
 public:
  using RobotXml::RobotXml;

  void read() {
    const std::uint32_t model = find_model();
    robot_.name = xml_.attribute(model, "name");
    for (const std::uint32_t e : children(model)) {
      if (xml_[e].name == "include" || xml_[e].name == "model")
        xml_.fail(e, "is not read. Write its links and joints into the model itself");
      if (xml_[e].name != "link") continue;
      add_link(name_of(e), e);
      elements_.push_back(e);
    }
    if (robot_.links.empty()) xml_.fail(model, "contains no <link>. Add at least one");
    for (std::size_t i = 0; i < elements_.size(); ++i) read_shapes(elements_[i], robot_.links[i]);
    const std::vector<std::uint32_t> joints = children(model, "joint");
    for (const std::uint32_t e : joints) read_joint(e);
    for (const std::uint32_t e : joints) {
      const std::uint32_t axis = xml_.child(e, "axis");
      const std::uint32_t mimic = axis == kNoTag ? kNoTag : xml_.child(axis, "mimic");
      if (mimic != kNoTag) read_mimic(mimic, joint_.at(name_of(e)));
    }
    require_tree(model);
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

  /// The words of a child's text.
  std::string text(std::uint32_t element, std::string_view name) const override {
    const std::uint32_t e = xml_.child(element, name);
    std::string out;
    if (e != kNoTag)
      for_words(xml_[e].text,
                [&](std::string_view word) { (out += out.empty() ? "" : " ") += word; });
    return out;
  }

  /// The <pose> of an element; `relative_to`: its reference frame, if the file states one.
  Eigen::Isometry3d pose(std::uint32_t element, std::string& relative_to) const {
    const std::uint32_t e = xml_.child(element, "pose");
    if (e == kNoTag) return Eigen::Isometry3d::Identity();
    relative_to = xml_.attribute(e, "relative_to");
    if (const auto format = xml_.attribute(e, "rotation_format");
        !format.empty() && format != "euler_rpy")
      xml_.fail(e, "its rotation_format is not read. Use x y z roll pitch yaw");
    const double unit = xml_.attribute(e, "degrees") == "true" ? std::numbers::pi / 180 : 1;
    const std::vector<double> v = numbers(element, "pose", {0, 0, 0, 0, 0, 0});
    return Eigen::Translation3d(v[0], v[1], v[2]) * turned(unit * v[3], unit * v[4], unit * v[5]);
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
    for (const std::uint32_t e : children(element)) {
      const bool collides = xml_[e].name == "collision";
      if (!collides && xml_[e].name != "visual") continue;
      const std::uint32_t shape = shape_in(e);
      if (xml_[shape].name == "empty") continue;
      PlacedLinkShape placed;
      placed.line = line_of(e);
      try {
        std::string to;
        const Eigen::Isometry3d at = pose(e, to);
        if (!to.empty() && to != link.name)
          xml_.fail(e, "its pose is relative to " + in_quotes(to) + ", not to its link");
        placed.rotation = Eigen::Quaterniond(at.linear());
        placed.translation = at.translation();
        if (xml_.child(shape, "submesh") != kNoTag)
          xml_.fail(shape, "a submesh is not read. Write it into a file of its own");
        placed.shape = shape_of(shape, text(shape, "uri"), "<uri>…</uri>");
      } catch (const Error& error) {
        placed.shape = LinkFault{error.what()};
      }
      (collides ? link.collision : link.visual).push_back(std::move(placed));
    }
  }

  void read_joint(std::uint32_t e) {
    const auto end = [&](const char* which) {
      const std::string name = text(e, which);
      return name == kWorld && !link_.contains(kWorld) ? add_link(kWorld, e)
                                                       : link_named(e, which, name);
    };
    RobotJoint joint;
    joint.name = name_of(e);
    const std::size_t parent = end("parent"), child = end("child");
    std::string to;
    Eigen::Isometry3d at = pose(e, to);  // in the child's frame by default
    const Eigen::Isometry3d child_frame = frame_of(child), parent_frame = frame_of(parent);
    if (to == "__model__")
      at = child_frame.inverse() * at;
    else if (!to.empty() && !link_.contains(to))
      xml_.fail(e, "its pose is relative to " + in_quotes(to) + ", which is no link");
    else if (!to.empty())
      at = child_frame.inverse() * frame_of(link_.at(to)) * at;
    joint.parent = parent;
    joint.origin = parent_frame.inverse() * child_frame * at;
    read_type(e, " ball universal revolute2 screw gearbox", joint);
    if (joint.motion != RobotJoint::Motion::fixed) {
      const std::uint32_t axis = xml_.child(e, "axis");
      if (axis == kNoTag) xml_.fail(e, "has no <axis>. Add one");
      read_axis(axis, xml_.attribute(e, "type") == "continuous", child_frame * at, joint);
    }
    const bool is_direct = at.isApprox(Eigen::Isometry3d::Identity(), 0);
    RobotJoint rest;
    rest.name = joint.name + "_fixed";
    rest.child = child;
    rest.origin = at.inverse();
    rest.parent = joint.child = is_direct ? child : add_link(joint.name + "_frame", e);
    add_joint(e, std::move(joint));
    if (!is_direct) robot_.joints.push_back(std::move(rest));
  }

  /// `frame`: of the joint in the model.
  void read_axis(std::uint32_t axis, bool endless, const Eigen::Isometry3d& frame,
                 RobotJoint& joint) const {
    Vector3d along = vector(axis, "xyz", Vector3d::UnitZ());
    if (const std::uint32_t xyz = xml_.child(axis, "xyz"); !text(axis, "xyz").empty()) {
      const std::string in(xml_.attribute(xyz, "expressed_in"));
      const std::string in_parent = text(axis, "use_parent_model_frame");
      if (in == "__model__" || in_parent == "true" || in_parent == "1")
        along = frame.linear().transpose() * along;
      else if (!in.empty() && link_.contains(in))
        along = frame.linear().transpose() * (frame_of(link_.at(in)).linear() * along);
      else if (!in.empty() && in != joint.name)
        xml_.fail(xyz, "is expressed in " + in_quotes(in) + ", which is no link");
    }
    take_axis(axis, along, joint);
    const std::uint32_t limit = xml_.child(axis, "limit");
    constexpr double kEndless = 1e15;  // value that writers use for no limit
    const auto [lower, upper] =
        limit == kNoTag ? std::pair(-kEndless, kEndless) : limits_of(limit, kEndless);
    const bool limited = lower > -kEndless && upper < kEndless;
    joint.taken_as_fixed =  // it has no middle
        joint.motion == RobotJoint::Motion::sliding && !limited;
    if (joint.taken_as_fixed) joint.motion = RobotJoint::Motion::fixed;
    if (!endless && limited) std::tie(joint.lower, joint.upper) = std::pair(lower, upper);
  }

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
