#include "robot/robot_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "mesh/import/text_scanner.h"
#include "mesh/import/xml_document.h"

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t kNone = XmlDocument::kNone;

/// What the five entities that every XML file may use stand for.
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
      xml_.fail(0, "is not a robot: a URDF begins with <robot name=\"…\">");
    robot_.name = decoded(xml_.attribute(0, "name"));
    for (std::uint32_t e = xml_[0].first_child; e != kNone; e = xml_[e].next_sibling) {
      if (xml_[e].name == "link") read_link(e);
      if (xml_[e].name == "joint") joints_.push_back(e);
    }
    if (robot_.links.empty()) xml_.fail(0, "contains no <link>. Add at least one");
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
    for (std::uint32_t e = xml_[element].first_child; e != kNone; e = xml_[e].next_sibling) {
      if (xml_[e].name == "collision") {
        link.collision.push_back(read_placed(e));
        link.collision_bytes.emplace_back(xml_[e].offset, xml_[e].end);
      } else if (xml_[e].name == "visual") {
        link.visual.push_back(read_placed(e));
      }
    }
    robot_.links.push_back(std::move(link));
  }

  PlacedShape read_placed(std::uint32_t element) const {
    PlacedShape placed;
    const auto& bytes = robot_.file.bytes;
    placed.line = 1 + static_cast<std::size_t>(std::count(
                          bytes.begin(),
                          bytes.begin() + static_cast<std::ptrdiff_t>(xml_[element].offset), '\n'));
    if (const std::uint32_t origin = xml_.child(element, "origin"); origin != kNone) {
      placed.translation = vector(origin, "xyz", Vector3d::Zero());
      const Vector3d rpy = vector(origin, "rpy", Vector3d::Zero());
      placed.rotation = Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) *
                        Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
                        Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX());
    }
    const std::uint32_t geometry = xml_.child(element, "geometry");
    const std::uint32_t shape = geometry == kNone ? kNone : xml_[geometry].first_child;
    if (shape == kNone) xml_.fail(element, "has no <geometry> with a shape. Add one");
    placed.shape = read_shape(shape);
    return placed;
  }

  Shape read_shape(std::uint32_t e) const {
    const std::string_view kind = xml_[e].name;
    if (kind == "mesh") {
      LinkMesh mesh;
      mesh.file = decoded(xml_.attribute(e, "filename"));
      if (mesh.file.empty()) xml_.fail(e, "has no file. Add filename=\"…\"");
      mesh.scale = vector(e, "scale", Vector3d::Ones());
      if ((mesh.scale.array() == 0).any())
        xml_.fail(e, "a scale of 0 makes the mesh flat. Use nonzero factors, e.g. scale=\"1 1 1\"");
      return mesh;
    }
    if (kind == "box") return LinkBox{0.5 * lengths(e, "size")};
    if (kind == "cylinder") return LinkCylinder{length(e, "radius"), 0.5 * length(e, "length")};
    if (kind == "sphere") return LinkBall{length(e, "radius")};
    xml_.fail(e, "is an unknown shape. Use mesh, box, cylinder or sphere");
  }

  /// Finite numbers, as many as there are places.
  template <std::size_t N>
  std::array<double, N> numbers(std::uint32_t e, std::string_view name,
                                std::string_view text) const {
    std::array<double, N> values{};
    std::size_t count = 0;
    while (true) {
      const std::size_t begin = text.find_first_not_of(" \t\r\n");
      if (begin == std::string_view::npos) break;
      const std::size_t end = std::min(text.find_first_of(" \t\r\n", begin), text.size());
      const std::string_view word = text.substr(begin, end - begin);
      const std::optional<double> value = parse_real(word);
      if (!value || !std::isfinite(*value) || std::abs(*value) > kLargest)
        xml_.fail(e, std::string(name) + ": " + in_quotes(word) +
                         " is not a finite number of at most 1e100");
      if (count < N) values[count] = *value;
      ++count;
      text.remove_prefix(end);
    }
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
  double length(std::uint32_t e, std::string_view name) const {
    const double value = numbers<1>(e, name, xml_.attribute(e, name))[0];
    require_length(e, name, value);
    return value;
  }

  std::size_t end_of(std::uint32_t joint, std::string_view which) const {
    const std::uint32_t e = xml_.child(joint, which);
    const std::string name = e == kNone ? "" : decoded(xml_.attribute(e, "link"));
    const auto found = link_.find(name);
    if (found == link_.end())
      xml_.fail(joint, "its " + std::string(which) + " " + in_quotes(name) + " is not a link");
    return found->second;
  }

  /// Every link but one is the child of one joint, and none its own ancestor.
  void require_tree() const {
    constexpr std::size_t kRoot = SIZE_MAX;
    std::vector<std::size_t> parent(robot_.links.size(), kRoot);
    for (const std::uint32_t joint : joints_) {
      const std::size_t child = end_of(joint, "child");
      if (parent[child] != kRoot)
        xml_.fail(joint, "link " + in_quotes(robot_.links[child].name) +
                             " already has a parent. A URDF is a tree");
      parent[child] = end_of(joint, "parent");
    }
    std::vector<char> state(parent.size(), 0);  // 1: on the way up, 2: leads to a root
    std::size_t roots = 0;
    for (std::size_t first = 0; first < parent.size(); ++first) {
      if (parent[first] == kRoot) ++roots;
      std::vector<std::size_t> way;
      std::size_t at = first;
      for (; at != kRoot && state[at] == 0; at = parent[at]) {
        state[at] = 1;
        way.push_back(at);
      }
      if (at != kRoot && state[at] == 1)
        xml_.fail(0, "its joints form a cycle through link " + in_quotes(robot_.links[at].name) +
                         ". A URDF is a tree");
      for (const std::size_t link : way) state[link] = 2;
    }
    if (roots != 1)
      xml_.fail(0, "has " + std::to_string(roots) +
                       " links without a parent. Connect them by joints: a URDF is one tree");
  }

  static constexpr double kLargest = 1e100;

  RobotModel& robot_;
  const XmlDocument xml_;
  std::map<std::string, std::size_t> link_;
  std::vector<std::uint32_t> joints_;
};

}  // namespace

RobotModel read_robot(SourceFile file) {
  RobotModel robot;
  robot.file = std::move(file);
  RobotReader(robot).read();
  return robot;
}

RobotModel read_robot(const std::string& path) { return read_robot(read_source_file(path)); }

}  // namespace ist
