#include "robots/description/robot_model.h"

#include <tuple>
#include <utility>

#include "robots/description/robot_xml.h"

namespace ist {
namespace {

class UrdfReader final : RobotXml {
 public:
  using RobotXml::RobotXml;

  void read() {
    if (xml_[0].name != "robot")
      xml_.fail(0,
                "is not a robot: a URDF begins with <robot name=\"…\">, an MJCF with "
                "<mujoco>, an SDF with <sdf>");
    robot_.name = text(0, "name");
    for (const std::uint32_t e : children(0)) {
      if (xml_[e].name == "link") read_link(e);
      if (xml_[e].name.starts_with("xacro:"))
        xml_.fail(e, "is a macro of xacro, not a URDF. Expand it: xacro IN.xacro -o OUT.urdf");
    }
    if (robot_.links.empty()) xml_.fail(0, "contains no <link>. Add at least one");
    const std::vector<std::uint32_t> joints = children(0, "joint");
    for (const std::uint32_t e : joints) read_joint(e);
    for (std::size_t j = 0; j < joints.size(); ++j)
      if (const std::uint32_t mimic = xml_.child(joints[j], "mimic");
          mimic != kNoTag && robot_.joints[j].motion != RobotJoint::Motion::fixed)
        read_mimic(mimic, j);
    require_tree(0);
  }

 private:
  std::string text(std::uint32_t element, std::string_view name) const override {
    return decoded(xml_.attribute(element, name));
  }

  void read_link(std::uint32_t element) {
    RobotLink& link = robot_.links[add_link(name_of(element), element)];
    link.begin = xml_[element].offset;
    link.end = xml_[element].end;
    for (const std::uint32_t e : children(element))
      if (xml_[e].name == "collision") {
        link.collision.push_back(read_placed(e));
        link.collision_bytes.emplace_back(xml_[e].offset, xml_[e].end);
      } else if (xml_[e].name == "visual") {
        try {
          link.visual.push_back(read_placed(e));
        } catch (const Error& error) {  // most robots are never read for these shapes
          link.visual.emplace_back().shape = LinkFault{error.what()};
        }
      }
  }

  std::pair<Eigen::Quaterniond, Eigen::Vector3d> read_origin(std::uint32_t element) const {
    const std::uint32_t origin = xml_.child(element, "origin");
    const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
    if (origin == kNoTag) return {Eigen::Quaterniond::Identity(), zero};
    const Eigen::Vector3d rpy = vector(origin, "rpy", zero);
    return {turned(rpy.x(), rpy.y(), rpy.z()), vector(origin, "xyz", zero)};
  }

  PlacedLinkShape read_placed(std::uint32_t element) const {
    PlacedLinkShape placed;
    placed.line = line_of(element);
    std::tie(placed.rotation, placed.translation) = read_origin(element);
    const std::uint32_t shape = shape_in(element);
    const std::string_view file = xml_.attribute(shape, "filename");
    placed.shape = shape_of(shape, decoded(file), "filename=\"…\"");
    if (auto* const mesh = std::get_if<LinkMesh>(&placed.shape)) {
      mesh->name_begin = static_cast<std::size_t>(file.data() - robot_.file.bytes.data());
      mesh->name_end = mesh->name_begin + file.size();
    }
    return placed;
  }

  void read_joint(std::uint32_t e) {
    const auto end = [&](const char* which) {
      const std::uint32_t named = xml_.child(e, which);
      return link_named(e, which, named == kNoTag ? "" : text(named, "link"));
    };
    RobotJoint joint;
    joint.name = text(e, "name");
    joint.child = end("child");
    joint.parent = end("parent");
    const auto [rotation, translation] = read_origin(e);
    joint.origin = Eigen::Translation3d(translation) * rotation;
    read_type(e, " floating planar", joint);
    if (joint.motion != RobotJoint::Motion::fixed) {
      name_of(e);
      const std::uint32_t axis = xml_.child(e, "axis"), limit = xml_.child(e, "limit");
      take_axis(
          e,
          axis == kNoTag ? Eigen::Vector3d::UnitX() : vector(axis, "xyz", Eigen::Vector3d::UnitX()),
          joint);
      if (xml_.attribute(e, "type") != "continuous") {
        if (limit == kNoTag) xml_.fail(e, "has no <limit>. Add lower=\"…\" and upper=\"…\"");
        std::tie(joint.lower, joint.upper) = limits_of(limit, 0);
      }
    }
    add_joint(e, std::move(joint));
  }
};

}  // namespace

RobotModel read_robot(SourceFile file) {
  const std::string root(XmlDocument(file)[0].name);
  if (root == "mujoco") return read_mjcf(std::move(file));
  if (root == "sdf") return read_sdf(std::move(file));
  RobotModel robot;
  robot.file = std::move(file);
  UrdfReader(robot).read();
  return robot;
}

RobotModel read_robot(const std::string& path) { return read_robot(read_source_file(path)); }

}  // namespace ist
