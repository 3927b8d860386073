#include "robots/description/sphere_files.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <string_view>

#include "mesh/import/xml_document.h"
#include "robots/description/kinematics.h"
#include "robots/description/self_collision.h"

namespace ist {
namespace {

/// The shortest text that reads back as the same number, without an exponent, since some readers of
/// YAML take that for a word.
std::string number(double x) {
  char text[400];
  const auto end = std::to_chars(text, text + sizeof text, x + 0.0, std::chars_format::fixed).ptr;
  return std::string(text, end);
}

/// The same, for readers that distinguish integers from other numbers.
std::string real(double x) {
  const std::string text = number(x);
  return text.find('.') == std::string::npos ? text + ".0" : text;
}

std::string vector(const Eigen::Vector3d& v, const char* between) {
  return number(v.x()) + between + number(v.y()) + between + number(v.z());
}

/// A name as a YAML key: plain if it is unambiguous, else in quotes.
std::string yaml_text(std::string_view text) {
  const bool plain =
      text.find('_') != std::string_view::npos &&
      std::all_of(text.begin(), text.end(),
                  [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }) &&
      std::isalpha(static_cast<unsigned char>(text.front()));
  if (plain) return std::string(text);
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

/// A capsule as a cylinder and two spheres: URDF has no capsules.
std::string collisions(const LinkSpheres& link, const std::string& indent) {
  std::string out;
  const auto add = [&](const std::string& name, const Eigen::Vector3d& at, const std::string& rpy,
                       const std::string& geometry) {
    if (!out.empty()) out += "\n" + indent;
    out += "<collision name=\"" + xml_text(link.link) + name + "\"><origin xyz=\"" +
           vector(at, " ") + "\" rpy=\"" + rpy + "\"/><geometry>" + geometry +
           "</geometry></collision>";
  };
  const auto ball = [&](const std::string& name, const Eigen::Vector3d& at, double radius) {
    add(name, at, "0 0 0", "<sphere radius=\"" + number(radius) + "\"/>");
  };
  for (std::size_t i = 0; i < link.capsules.size(); ++i) {
    const auto& [begin, end, radius] = link.capsules[i];
    const Eigen::Vector3d along = end - begin;
    const std::string name = "_capsule_" + std::to_string(i);
    ball(name + "_begin", begin, radius);
    ball(name + "_end", end, radius);
    if (!along.isZero(0))  // rotates z to the capsule's axis
      add(name, (begin + end) / 2,
          "0 " + number(std::atan2(along.head<2>().norm(), along.z())) + " " +
              number(std::atan2(along.y(), along.x())),
          "<cylinder radius=\"" + number(radius) + "\" length=\"" + number(along.norm()) + "\"/>");
  }
  for (std::size_t i = 0; i < link.spheres.size(); ++i)
    ball("_sphere_" + std::to_string(i), link.spheres[i].centre, link.spheres[i].radius);
  return out;
}

/// The text before a byte on its line, if that is only white space.
std::string indent_before(std::string_view text, std::size_t at) {
  std::size_t begin = at;
  while (begin > 0 && (text[begin - 1] == ' ' || text[begin - 1] == '\t')) --begin;
  return begin == 0 || text[begin - 1] == '\n' ? std::string(text.substr(begin, at - begin)) : "";
}

void append_yaml(std::span<const LinkSpheres> links, const std::string& indent, std::string& out) {
  for (const LinkSpheres& link : links) {
    out += indent + yaml_text(link.link) + ":\n";
    for (const CoverSphere& s : link.spheres)
      out += indent + "  - center: [" + vector(s.centre, ", ") + "]\n" + indent +
             "    radius: " + number(s.radius) + "\n";
  }
}

std::string yaml_list(const std::vector<std::string>& items) {
  std::string out;
  for (const std::string& item : items) out += (out.empty() ? "" : ", ") + item;
  return "[" + out + "]";
}

/// "self_collision_ignore:" and the links that each link ignores, each pair once.
void append_ignored(const SelfCollision& self, const std::string& key, const std::string& indent,
                    std::string& out) {
  std::map<std::string, std::vector<std::string>> ignored;
  for (const LinkPair& pair : self.pairs)
    if (!pair.ignored.empty()) ignored[pair.a].push_back(yaml_text(pair.b));
  out += indent + key + (ignored.empty() ? ": {}\n" : ":\n");
  for (const auto& [link, others] : ignored)
    out += indent + "  " + yaml_text(link) + ": " + yaml_list(others) + "\n";
}

/// Buffers of 0: spheres are compared unchanged, since smaller ones would miss collisions of the
/// link with all others.
void append_buffers(std::span<const LinkSpheres> links, const std::string& key,
                    const std::string& indent, std::string& out) {
  out += indent + key + ":\n";
  for (const LinkSpheres& link : links) out += indent + "  " + yaml_text(link.link) + ": 0.0\n";
}

// Values that a URDF does not contain, as in cuRobo's own robots.
constexpr double kAcceleration = 15;  // [rad/s², u/s²]
constexpr double kJerk = 500;         // [rad/s³, u/s³]

/// Free joints: names, default positions, and a number for each.
struct Cspace {
  Cspace(const RobotModel& robot, const SelfCollision& self) {
    for (std::size_t j = 0; j < robot.joints.size(); ++j) {
      if (!robot.joints[j].is_free()) continue;
      names.push_back(yaml_text(robot.joints[j].name));
      positions.push_back(real(self.pose.positions[j]));
      (self.locked.contains(j) ? locked : moving).push_back(names.back());
      if (self.locked.contains(j)) locked.back() += ": " + positions.back();
    }
  }
  static std::string each(const std::vector<std::string>& joints, double value) {
    return yaml_list(std::vector<std::string>(joints.size(), real(value)));
  }
  std::vector<std::string> names, positions;
  std::vector<std::string> moving, locked;  ///< names; "name: position"
};

std::vector<std::string> tool_names(const RobotModel& robot) {
  std::vector<std::string> names;
  for (const std::size_t link : tool_links(robot))
    names.push_back(yaml_text(robot.links[link].name));
  return names;
}

}  // namespace

std::string urdf_with_spheres(const RobotModel& robot, std::span<const LinkSpheres> links,
                              const std::string& folder) {
  namespace fs = std::filesystem;
  const std::string_view bytes = robot.file.bytes;
  struct Edit {
    std::size_t begin, end;
    std::string text;
  };
  std::vector<Edit> edits;
  const fs::path from = fs::absolute(robot.file.path).lexically_normal().parent_path();
  const fs::path to = fs::absolute(fs::path(folder) / "x").lexically_normal().parent_path();
  const bool moved = !folder.empty() && from != to;
  for (const RobotLink& link : robot.links) {
    const auto found = std::find_if(links.begin(), links.end(),
                                    [&](const LinkSpheres& one) { return one.link == link.name; });
    const bool replaced = found != links.end();
    for (const auto* const shapes : {&link.collision, &link.visual})
      for (const PlacedLinkShape& placed : *shapes) {
        const auto* const mesh = std::get_if<LinkMesh>(&placed.shape);
        if (!moved || mesh == nullptr || (replaced && shapes == &link.collision) ||
            mesh->file.find("://") != std::string::npos || fs::path(mesh->file).is_absolute())
          continue;
        const fs::path file = (from / mesh->file).lexically_normal().lexically_relative(to);
        edits.push_back({mesh->name_begin, mesh->name_end, xml_text(file.generic_string())});
      }
    if (!replaced) continue;
    bool written = false;
    for (const auto& [begin, end] : link.collision_bytes) {
      const std::string indent = indent_before(bytes, begin);
      std::size_t first = begin;
      if (written) {  // no empty line is left
        first -= indent.size();
        if (bytes[first - 1] == '\n') --first;
      }
      edits.push_back({first, end, written ? "" : collisions(*found, indent)});
      written = true;
    }
    if (written) continue;
    // The spheres replace visual shapes: the link had no collision.
    const std::size_t at = bytes.rfind("</", link.end);
    edits.push_back({at, at, "  " + collisions(*found, "    ") + "\n  "});
  }
  std::sort(edits.begin(), edits.end(),
            [](const Edit& a, const Edit& b) { return a.begin < b.begin; });
  std::string out;
  std::size_t copied = 0;
  for (const Edit& edit : edits) {
    const std::size_t begin = std::max(copied, edit.begin);
    out += bytes.substr(copied, begin - copied);
    out += edit.text;
    copied = std::max(copied, edit.end);
  }
  return out + std::string(bytes.substr(copied));
}

std::string urdf_of_spheres(const LinkSpheres& link) {
  return "<?xml version=\"1.0\"?>\n<robot name=\"" + xml_text(link.link) + "\">\n  <link name=\"" +
         xml_text(link.link) + "\">\n    " + collisions(link, "    ") + "\n  </link>\n</robot>\n";
}

std::string curobo_spheres(std::span<const LinkSpheres> links) {
  std::string out = "collision_spheres:\n";
  append_yaml(links, "  ", out);
  return out;
}

std::string curobo_robot(const RobotModel& robot, const std::string& urdf,
                         std::span<const LinkSpheres> links, const SelfCollision& self) {
  const Cspace cspace(robot, self);
  std::vector<std::string> names;
  for (const LinkSpheres& link : links) names.push_back(yaml_text(link.link));
  const std::string all = yaml_list(names);
  std::string out = "robot_cfg:\n  kinematics:\n";
  const auto line = [&](const std::string& text) { out += "    " + text + "\n"; };
  line("format_version: 2.0");
  line("urdf_path: " + yaml_text(urdf) + "  # as is the next, relative to this file");
  const std::string folder = std::filesystem::path(urdf).parent_path().string();
  line("asset_root_path: " + yaml_text(folder.empty() ? "." : folder));
  line("base_link: " + yaml_text(robot.links[robot.order.front()].name));
  line("tool_frames: " + yaml_list(tool_names(robot)));
  const std::string locked = yaml_list(cspace.locked);
  line("lock_joints: " +
       (cspace.locked.empty() ? "null" : "{" + locked.substr(1, locked.size() - 2) + "}"));
  line("extra_links: null");
  line("collision_link_names: " + all);
  line("mesh_link_names: " + all);
  line("collision_sphere_buffer: 0.0");
  append_ignored(self, "self_collision_ignore", "    ", out);
  append_buffers(links, "self_collision_buffer", "    ", out);
  line("cspace:");
  line("  joint_names: " + yaml_list(cspace.names));
  line("  default_joint_position: " + yaml_list(cspace.positions));
  line("  null_space_weight: " + cspace.each(cspace.names, 1));
  line("  cspace_distance_weight: " + cspace.each(cspace.names, 1));
  line("  max_acceleration: " + real(kAcceleration) + "  # a URDF has none; set your robot's");
  line("  max_jerk: " + real(kJerk) + "  # a URDF has none; set your robot's");
  line("collision_spheres:");
  append_yaml(links, "      ", out);
  return out;
}

std::string xrdf(const RobotModel& robot, std::span<const LinkSpheres> links,
                 const SelfCollision& self) {
  const std::string geometry = yaml_text((robot.name.empty() ? "robot" : robot.name) + "_spheres");
  const Cspace cspace(robot, self);
  std::string out = "format: xrdf\nformat_version: 1.0\n\ndefault_joint_positions:";
  if (cspace.names.empty()) out += " {}";
  for (std::size_t j = 0; j < cspace.names.size(); ++j)
    out += "\n  " + cspace.names[j] + ": " + cspace.positions[j];
  out += "\n\n# A URDF has no limits of acceleration and jerk: set your robot's.\ncspace:";
  out += "\n  joint_names: " + yaml_list(cspace.moving);
  out += "\n  acceleration_limits: " + cspace.each(cspace.moving, kAcceleration);
  out += "\n  jerk_limits: " + cspace.each(cspace.moving, kJerk);
  out += "\n\ntool_frames: " + yaml_list(tool_names(robot)) + "\n\n";
  out += "collision:\n  geometry: " + geometry + "\n  buffer_distance: {}\n\n";
  out += "self_collision:\n  geometry: " + geometry + "\n";
  append_buffers(links, "buffer_distance", "  ", out);
  append_ignored(self, "ignore", "  ", out);
  out += "\ngeometry:\n  " + geometry + ":\n    spheres:\n";
  append_yaml(links, "      ", out);
  return out;
}

std::string srdf(const RobotModel& robot, std::span<const LinkSpheres> links,
                 const SelfCollision& self) {
  std::string out = "<?xml version=\"1.0\"?>\n<robot name=\"" + xml_text(robot.name) + "\">\n";
  for (const LinkSpheres& link : links) {
    out += "  <link_sphere_approximation link=\"" + xml_text(link.link) + "\">\n";
    for (const CoverSphere& s : link.spheres)
      out += "    <sphere center=\"" + vector(s.centre, " ") + "\" radius=\"" + number(s.radius) +
             "\"/>\n";
    out += "  </link_sphere_approximation>\n";
  }
  for (const LinkPair& pair : self.pairs)
    if (!pair.ignored.empty())
      out += "  <disable_collisions link1=\"" + xml_text(pair.a) + "\" link2=\"" +
             xml_text(pair.b) + "\" reason=\"" + pair.ignored + "\"/>\n";
  return out + "</robot>\n";
}

}  // namespace ist
