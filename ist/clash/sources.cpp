#include "clash/assembly.h"

#include <fmt/format.h>
#include <ist/pose_eigen.h>
#include <toml++/toml.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <tuple>
#include <utility>

#include "base/message_text.h"
#include "library/settings/spelling.h"
#include "mesh/import/source_file.h"
#include "mesh/mesh_files.h"
#include "robots/description/kinematics.h"
#include "robots/description/link_mesh.h"

namespace ist {
namespace {

namespace fs = std::filesystem;

class TomlReader {
 public:
  TomlReader(const std::string& path, bool rules_alone, ClashSource& out)
      : path_(path), folder_(fs::path(path).parent_path()), rules_alone_(rules_alone), out_(out) {}

  void read() {
    toml::table root;
    const SourceFile file = read_source_file(path_);
    try {
      root = toml::parse(file.bytes, path_);
    } catch (const toml::parse_error& error) {
      fail(error.source().begin.line,
           fmt::format("not valid TOML: {}. Write one key a line; see https://toml.io",
                       error.description()));
    }
    for (const auto& [key, value] : root) {
      const std::string kind(key.str());
      known(key, rules_alone_ ? std::vector<std::string>{"ignore", "group"}
                              : std::vector<std::string>{"part", "ignore", "group"});
      const toml::array* const list = value.as_array();
      if (list == nullptr || !list->is_array_of_tables())
        fail(key.source().begin.line,
             fmt::format("{0}: write [[{0}]], with two brackets, and its keys under it", kind));
      for (const toml::node& entry : *list) {
        const toml::table& table = *entry.as_table();
        if (kind == "part") read_part(table);
        if (kind == "ignore") read_ignored(table);
        if (kind == "group") read_group(table);
      }
    }
    if (!rules_alone_ && out_.parts.empty()) fail(1, "no [[part]]: add at least one");
  }

 private:
  [[noreturn]] void fail(toml::source_index line, const std::string& what) const {
    throw Error(fmt::format("{}:{}: {}", path_, line, what));
  }
  template <class Node>
  static toml::source_index line_of(const Node& node) {
    return node.source().begin.line;
  }

  void known(const toml::key& key, const std::vector<std::string>& keys) const {
    const std::string name(key.str());
    if (std::count(keys.begin(), keys.end(), name) != 0) return;
    const std::string nearest = nearest_word(name, keys);
    fail(line_of(key), nearest.empty()
                           ? fmt::format("unknown '{}': known are {}", name, fmt::join(keys, ", "))
                           : fmt::format("unknown '{}': did you mean '{}'?", name, nearest));
  }

  std::string text(const toml::node& node, const std::string& key) const {
    const auto* const value = node.as_string();
    if (value == nullptr || value->get().empty())
      fail(line_of(node), key + ": write a name in quotes");
    return value->get();
  }

  double number(const toml::node& node, const std::string& key) const {
    const std::optional<double> value = node.value<double>();
    if (!node.is_number() || !value || !std::isfinite(*value))
      fail(line_of(node), key + ": write finite numbers");
    return *value;
  }

  Pose pose(const toml::node& node) const {
    const toml::array* const list = node.as_array();
    if (list == nullptr || list->size() != 7)
      fail(line_of(node), "pose: write 7 numbers, [qw,qx,qy,qz, x,y,z]");
    Pose out;
    for (std::size_t k = 0; k < 7; ++k)
      (k < 4 ? out.q[k] : out.t[k - 4]) = number((*list)[k], "pose");
    if (Eigen::Vector4d(out.q).norm() < 1e-100 || Eigen::Vector4d(out.q).norm() > 1e100)
      fail(line_of(node), "pose: the first four numbers are a quaternion, w first; not all 0");
    return out;
  }

  /// A path in the folder of this file; the file must exist.
  std::string file(const toml::node& node, const std::string& key) const {
    const std::string path = (folder_ / text(node, key)).lexically_normal().string();
    std::error_code none;
    if (!fs::exists(path, none) || fs::is_directory(path, none))
      fail(line_of(node),
           fmt::format("{}: no file '{}'; paths are relative to this file's folder", key, path));
    return path;
  }

  void read_part(const toml::table& table) {
    ClashSource::Part part;
    ClashShape shape;
    for (const auto& [key, value] : table) {
      known(key, {"name", "mesh", "asset", "pose", "scale"});
      if (key == "name") part.name = text(value, "name");
      if (key == "pose") part.pose = pose(value);
      if (key == "scale" && !((part.scale = number(value, "scale")) > 0))
        fail(line_of(value), "scale: write a number above 0");
      if (key != "mesh" && key != "asset") continue;
      if (!shape.name.empty()) fail(line_of(value), "a part has a mesh or an asset, not both");
      shape.name = file(value, std::string(key.str()));
      if (key == "asset") continue;
      if (!is_mesh_format(shape.name))
        fail(line_of(value), "mesh: '" + shape.name + "' has not the ending of a mesh");
      shape.rounding = rounding_of_file(shape.name);
      shape.mesh = [path = shape.name] { return load_mesh(path); };
    }
    if (shape.name.empty())
      fail(line_of(table), "a part without a shape: add mesh = \"FILE\" or asset = \"FILE.ist\"");
    if (part.name.empty()) part.name = fs::path(shape.name).stem().string();
    const auto [before, fresh] = lines_.try_emplace(part.name, line_of(table));
    if (!fresh)
      fail(line_of(table), fmt::format("the part of line {} is called '{}' too: give this one "
                                       "another name = \"…\"",
                                       before->second, part.name));
    const auto [known_shape, is_new] = shapes_.try_emplace(shape.name, out_.shapes.size());
    part.shape = known_shape->second;
    if (is_new) out_.shapes.push_back(std::move(shape));
    out_.parts.push_back(std::move(part));
  }

  ClashSource::Patterns patterns(const toml::node& node, const std::string& key) const {
    if (const toml::array* const list = node.as_array()) {
      ClashSource::Patterns out;
      for (const toml::node& one : *list) out.push_back(text(one, key));
      return out;
    }
    return {text(node, key)};
  }

  void read_ignored(const toml::table& table) {
    std::pair<ClashSource::Patterns, ClashSource::Patterns> rule;
    for (const auto& [key, value] : table) {
      known(key, {"a", "b"});
      (key == "a" ? rule.first : rule.second) = patterns(value, std::string(key.str()));
    }
    if (rule.first.empty()) std::swap(rule.first, rule.second);
    if (rule.second.empty()) rule.second = {"*"};
    if (rule.first.empty())
      fail(line_of(table),
           "add a = \"PART\", alone or with b = \"PART\"; * stands for any letters");
    out_.ignored.push_back(std::move(rule));
  }

  void read_group(const toml::table& table) {
    std::string name;
    ClashSource::Patterns parts;
    for (const auto& [key, value] : table) {
      known(key, {"name", "parts"});
      if (key == "name") name = text(value, "name");
      if (key == "parts") parts = patterns(value, "parts");
    }
    if (name.empty() || parts.empty())
      fail(line_of(table), "add name = \"GROUP\" and parts = [\"PART\", …]");
    if (!out_.groups.try_emplace(name, parts).second)
      fail(line_of(table), fmt::format("two groups are called '{}'", name));
  }

  const std::string path_;
  const fs::path folder_;
  const bool rules_alone_;
  ClashSource& out_;
  std::map<std::string, toml::source_index> lines_;  ///< of parts by name
  std::map<std::string, std::size_t> shapes_;
};

}  // namespace

void read_clash_toml(const std::string& path, bool rules_alone, ClashSource& out) {
  TomlReader(path, rules_alone, out).read();
}

void read_clash_scene(const std::string& path, ClashSource& out) {
  MeshScene scene = read_mesh_scene(path);
  out.notes = scene.notes;
  const auto meshes = std::make_shared<std::vector<TriangleMesh>>(std::move(scene.meshes));
  std::map<std::vector<double>, std::size_t>
      shapes;  // by mesh, and the part of the transform that is not a pose
  std::map<std::string, int> taken;
  std::set<std::string> names;
  for (MeshScene::Part& part : scene.parts) {
    if ((*meshes)[part.mesh].triangles.empty()) {
      out.notes.push_back(fmt::format("{} has no triangles: it is no part", part.name));
      continue;
    }
    if (part.in_world.linear().isZero(0)) {
      out.notes.push_back(
          fmt::format("{} has the scale 0, which hides it: it is no part", part.name));
      continue;
    }
    // A rotation, after a mirror image if necessary, and one scale; otherwise the mesh is deformed.
    Eigen::Matrix3d linear = part.in_world.linear(), deformed = Eigen::Matrix3d::Identity();
    if (linear.determinant() < 0) deformed(0, 0) = -1;
    linear = linear * deformed;
    const double scale = linear.norm() / std::sqrt(3.0);
    if ((linear.transpose() * linear - scale * scale * Eigen::Matrix3d::Identity()).norm() >
        1e-13 * scale * scale)
      deformed = part.in_world.linear();
    const bool rigid = deformed.isDiagonal(0) && deformed.cwiseAbs().isIdentity(0);
    ClashSource::Part one;
    if (rigid && scale > 0) {
      one.scale = std::abs(scale - 1) < 1e-15 ? 1 : scale;
      Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
      place.linear() = linear / scale;
      one.pose = to_pose(place);
    }
    Eigen::Map<Eigen::Vector3d>(one.pose.t) = part.in_world.translation();
    std::vector<double> key(deformed.data(), deformed.data() + 9);
    key.push_back(static_cast<double>(part.mesh));
    const auto [known, fresh] = shapes.try_emplace(key, out.shapes.size());
    one.shape = known->second;
    one.name = part.name;
    for (int& count = taken[part.name]; !names.insert(one.name).second;)
      one.name = fmt::format("{}#{}", part.name, ++count + 1);
    if (fresh)
      out.shapes.push_back({fmt::format("{}: {}", path, part.name),
                            [meshes, mesh = part.mesh, deformed] {
                              TriangleMesh out_mesh = (*meshes)[mesh];
                              for (Eigen::Vector3d& v : out_mesh.vertices) v = deformed * v;
                              if (deformed.determinant() < 0)
                                for (auto& t : out_mesh.triangles) std::swap(t[1], t[2]);
                              return out_mesh;
                            },
                            kFloat32, scene.of_doubles ? kFloat64 : kFloat32});
    out.parts.push_back(std::move(one));
  }
  if (out.parts.empty()) throw Error(path + ": no node has a mesh of triangles");
}

void read_clash_robot(const std::string& path, const RobotOptions& options, ClashSource& out) {
  const auto robot = std::make_shared<RobotModel>(read_robot_for(options, path));
  if (const auto unseen = links_seen_only(*robot, options); !unseen.empty())
    out.notes.push_back(
        fmt::format("left out, because they have visual shapes alone: {}; --visual "
                    "uses these",
                    fmt::join(unseen, ", ")));
  if (!robot->endless.empty())
    out.notes.push_back(
        fmt::format("left out, because planes, height fields and flexes are no solids: {}",
                    fmt::join(robot->endless, ", ")));
  const PackagePaths paths = package_paths(path, options);
  std::vector<std::size_t> links;
  std::size_t round = 0;
  for (std::size_t i = 0; i < robot->links.size(); ++i) {
    const auto& shapes = robot->links[i].shapes(options.shapes());
    if (shapes.empty()) continue;
    ClashShape shape{
        path + ": link " + robot->links[i].name, [robot, paths, i, which = options.shapes()] {
          LinkGeometry all = geometry_of(robot->links[i].shapes(which), paths, robot->file.path);
          for (const CoverSphere& s : all.spheres)
            append_mesh(all.mesh, capsule_mesh({s.centre, s.centre, s.radius}).mesh);
          return std::move(all.mesh);
        }};
    for (const PlacedLinkShape& one : shapes) {
      if (std::holds_alternative<LinkMesh>(one.shape))
        shape.rounding =
            std::max(shape.rounding, rounding_of_file(std::get<LinkMesh>(one.shape).file));
      else if (!std::holds_alternative<LinkBox>(one.shape)) {
        ++round;
        const auto* const ball = std::get_if<LinkBall>(&one.shape);
        const Eigen::Vector3d centre = Eigen::Vector3d::Zero();
        shape.slack = std::max(shape.slack, ball != nullptr
                                                ? capsule_mesh({centre, centre, ball->radius}).slack
                                                : mesh_of(one, paths, path).slack);
      }
    }
    out.parts.push_back({robot->links[i].name, out.shapes.size(), {}, 1});
    out.shapes.push_back(std::move(shape));
    links.push_back(i);
  }
  if (round > 0)
    out.notes.push_back(counted(round, "round shape is a polyhedron around it",
                                "round shapes are polyhedra around them") +
                        ", at most 0.5 % wider");
  for (const auto& [a, b] : robot->excluded)
    out.ignored.push_back({{robot->links[a].name}, {robot->links[b].name}});
  out.posed = [robot, links, path](const std::map<std::string, double>& values) {
    Positions positions = default_positions(*robot);
    std::vector<std::string> free;
    for (const RobotJoint& joint : robot->joints)
      if (joint.is_free()) free.push_back(joint.name);
    for (const auto& [name, value] : values) {
      const std::size_t at = index_named(robot->joints, name);
      if (at == robot->joints.size() || !robot->joints[at].is_free()) {
        const std::string nearest = nearest_word(name, free);
        throw Error(fmt::format("{}: no joint that moves freely is called '{}'{}", path, name,
                                nearest.empty()
                                    ? fmt::format("; there are {}", fmt::join(free, ", "))
                                    : fmt::format("; did you mean '{}'?", nearest)));
      }
      const RobotJoint& joint = robot->joints[at];
      if (!(value >= joint.lower && value <= joint.upper))
        throw Error(fmt::format("{}: {} = {:g}: the joint's limits are {:g} to {:g}", path, name,
                                value, joint.lower, joint.upper));
      positions[at] = value;
    }
    const std::vector<Eigen::Isometry3d> frames = link_frames(*robot, positions);
    std::vector<Pose> poses;
    for (const std::size_t link : links) poses.push_back(to_pose(frames[link]));
    return poses;
  };
}

}  // namespace ist
