#include "robot/sphere_files.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <string_view>

namespace ist {
namespace {

/// The shortest text without an exponent, which some readers of YAML take for a word, that reads
/// back as the same number.
std::string number(double x) {
  char text[400];
  const auto end = std::to_chars(text, text + sizeof text, x + 0.0, std::chars_format::fixed).ptr;
  return std::string(text, end);
}

std::string vector(const Eigen::Vector3d& v, const char* between) {
  return number(v.x()) + between + number(v.y()) + between + number(v.z());
}

std::string xml_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

/// A name as a YAML key: plain where that can be no other value, else in quotes.
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

std::string collisions(const LinkSpheres& link, const std::string& indent) {
  std::string out;
  for (std::size_t i = 0; i < link.spheres.size(); ++i) {
    const CoverSphere& s = link.spheres[i];
    if (i != 0) out += "\n" + indent;
    out += "<collision name=\"" + xml_text(link.link) + "_sphere_" + std::to_string(i) +
           "\"><origin xyz=\"" + vector(s.centre, " ") +
           "\" rpy=\"0 0 0\"/><geometry><sphere radius=\"" + number(s.radius) +
           "\"/></geometry></collision>";
  }
  return out;
}

/// What stands before a byte on its line, if that is space alone.
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

}  // namespace

std::string urdf_with_spheres(const RobotModel& robot, std::span<const LinkSpheres> links) {
  const std::string_view bytes = robot.file.bytes;
  std::string out;
  std::size_t copied = 0;
  const auto copy_to = [&](std::size_t to) {
    out += bytes.substr(copied, to - copied);
    copied = to;
  };
  for (const RobotLink& link : robot.links) {
    const auto found = std::find_if(links.begin(), links.end(),
                                    [&](const LinkSpheres& one) { return one.link == link.name; });
    if (found == links.end()) continue;
    bool written = false;
    for (const auto& [begin, end] : link.collision_bytes) {
      const std::string indent = indent_before(bytes, begin);
      if (!written) {
        copy_to(begin);
        out += collisions(*found, indent);
      } else {
        std::size_t line = begin - indent.size();  // an empty line is not left behind
        if (line > copied && bytes[line - 1] == '\n') --line;
        copy_to(line);
      }
      copied = end;
      written = true;
    }
    if (written) continue;
    // Spheres of visual shapes: the link had no collision.
    copy_to(bytes.rfind("</", link.end));
    out += "  " + collisions(*found, "    ") + "\n  ";
  }
  copy_to(bytes.size());
  return out;
}

std::string urdf_of_spheres(const LinkSpheres& link) {
  return "<?xml version=\"1.0\"?>\n<robot name=\"" + xml_text(link.link) + "\">\n  <link name=\"" +
         xml_text(link.link) + "\">\n    " + collisions(link, "    ") + "\n  </link>\n</robot>\n";
}

std::string curobo_yaml(std::span<const LinkSpheres> links) {
  std::string out = "collision_spheres:\n";
  append_yaml(links, "  ", out);
  return out;
}

std::string xrdf(const std::string& robot, std::span<const LinkSpheres> links) {
  const std::string geometry = yaml_text((robot.empty() ? "robot" : robot) + "_spheres");
  std::string out = "format: xrdf\nformat_version: 1.0\n\ncollision:\n  geometry: " + geometry +
                    "\n\nself_collision:\n  geometry: " + geometry + "\n\ngeometry:\n  " +
                    geometry + ":\n    spheres:\n";
  append_yaml(links, "      ", out);
  return out;
}

std::string srdf(const std::string& robot, std::span<const LinkSpheres> links) {
  std::string out = "<?xml version=\"1.0\"?>\n<robot name=\"" + xml_text(robot) + "\">\n";
  for (const LinkSpheres& link : links) {
    out += "  <link_sphere_approximation link=\"" + xml_text(link.link) + "\">\n";
    for (const CoverSphere& s : link.spheres)
      out += "    <sphere center=\"" + vector(s.centre, " ") + "\" radius=\"" + number(s.radius) +
             "\"/>\n";
    out += "  </link_sphere_approximation>\n";
  }
  return out + "</robot>\n";
}

}  // namespace ist
