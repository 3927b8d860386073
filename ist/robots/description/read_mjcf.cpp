#include "robots/description/robot_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <filesystem>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include <ist/types.h>

#include "mesh/import/text_scanner.h"
#include "mesh/import/xml_document.h"
#include "robots/description/robot_xml.h"

namespace ist {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using Attributes = std::map<std::string, std::string>;

constexpr const char* kAttributes[] = {
    "name",       "class",       "childclass", "file",      "type",    "size",   "fromto",
    "pos",        "quat",        "euler",      "axisangle", "xyaxes",  "zaxis",  "mesh",
    "contype",    "conaffinity", "axis",       "range",     "limited", "ref",    "scale",
    "refpos",     "refquat",     "angle",      "model",     "joint1",  "joint2", "meshdir",
    "assetdir",   "eulerseq",    "polycoef",   "body1",     "body2",   "active", "autolimits",
    "coordinate", "strippath"};

/// Each is the whole orientation of an element.
constexpr const char* kTurns[] = {"quat", "euler", "axisangle", "xyaxes", "zaxis"};

/// An element, with those of included files in their places.
struct Node {
  std::string name, where;  ///< "file: line n: <name>"
  std::size_t line;         ///< n, of the robot's own file; 0: of an included one
  Attributes attributes;
  std::vector<Node> children;
};

class MjcfReader {
 public:
  explicit MjcfReader(RobotModel& robot) : robot_(robot) {}

  void read() {
    const fs::path path(robot_.file.path);
    folder_ = path.parent_path();
    const Node root = tree_of(robot_.file, 0).front();
    robot_.name = value(root.attributes, "model", path.stem().string());
    for (const Node& node : root.children) {
      if (node.name == "compiler") read_compiler(node);
      if (node.name != "deformable") continue;
      for (const Node& one : node.children)
        if (one.name == "flex") robot_.endless.push_back(value(one.attributes, "name", "flex"));
    }
    defaults_[""];
    for (const Node& node : root.children)
      if (node.name == "default") read_defaults(node, "");
    for (const Node& node : root.children)
      if (node.name == "asset")
        for (const Node& one : node.children)
          if (one.name == "mesh") read_mesh(one);
    add_link("world", kNone, {});
    for (const Node& node : root.children)
      if (node.name == "worldbody") read_inside(node, 0, "");
    for (const Node& node : root.children) {
      if (node.name == "contact") read_contact(node);
      if (node.name == "equality") read_equality(node);
    }
    for (std::size_t i = 0; i < robot_.links.size(); ++i) robot_.order.push_back(i);
  }

 private:
  [[noreturn]] static void fail(const Node& node, const std::string& what) {
    throw Error(node.where + ": " + what);
  }

  static std::string value(const Attributes& attributes, const std::string& key,
                           const std::string& otherwise = "") {
    const auto found = attributes.find(key);
    return found == attributes.end() ? otherwise : found->second;
  }

  /// The document's first element alone; its includes are read.
  std::vector<Node> tree_of(const SourceFile& file, int depth) {
    constexpr int kDeepest = 32;
    const XmlDocument xml(file);
    if (depth > kDeepest) xml.fail(0, "is included by itself");
    return {node_of(xml, 0, file.path, depth)};
  }

  Node node_of(const XmlDocument& xml, std::uint32_t element, const std::string& path, int depth) {
    Node node;
    node.name = xml[element].name;
    const auto& bytes = depth == 0 ? robot_.file.bytes : included_.back().bytes;
    const auto line = static_cast<std::size_t>(
        1 + std::count(bytes.begin(),
                       bytes.begin() + static_cast<std::ptrdiff_t>(xml[element].offset), '\n'));
    node.line = depth == 0 ? line : 0;
    node.where = path + ": line " + std::to_string(line) + ": <" + node.name + ">";
    for (const char* const key : kAttributes)
      if (const std::string_view text = xml.attribute(element, key); !text.empty())
        node.attributes[key] = decoded(text);
    if (const std::string fault = name_fault(value(node.attributes, "name")); !fault.empty())
      fail(node, fault);
    for (std::uint32_t e = xml[element].first_child; e != XmlDocument::kNone;
         e = xml[e].next_sibling) {
      if (xml[e].name != "include") {
        node.children.push_back(node_of(xml, e, path, depth));
        continue;
      }
      const std::string name = decoded(xml.attribute(e, "file"));
      included_.push_back(read_source_file((folder_ / name).string()));
      Node inside = tree_of(included_.back(), depth + 1).front();
      included_.pop_back();
      std::move(inside.children.begin(), inside.children.end(), std::back_inserter(node.children));
    }
    return node;
  }

  std::vector<double> numbers(const Node& node, const std::string& key,
                              const std::string& text) const {
    std::vector<double> out;
    for_words(text, [&](std::string_view word) {
      const std::optional<double> number = parse_real(word);
      if (!number || !std::isfinite(*number) || std::abs(*number) > 1e100)
        fail(node, key + ": " + in_quotes(word) + " is not a finite number of at most 1e100");
      out.push_back(*number);
    });
    return out;
  }

  Vector3d vector(const Node& node, const Attributes& attributes, const std::string& key,
                  const Vector3d& otherwise) const {
    if (!attributes.contains(key)) return otherwise;
    const std::vector<double> v = numbers(node, key, attributes.at(key));
    if (v.size() != 3) fail(node, key + " must have 3 numbers");
    return {v[0], v[1], v[2]};
  }

  double angle(double given) const { return degrees_ ? given * std::numbers::pi / 180 : given; }

  void read_compiler(const Node& node) {
    const Attributes& a = node.attributes;
    if (value(a, "coordinate") == "global")
      fail(
          node,
          "global coordinates are not read, nor by MuJoCo. Save the model from MuJoCo 2.3.3, which "
          "resolves them");
    degrees_ = value(a, "angle", degrees_ ? "degree" : "radian") == "degree";
    meshes_ = value(a, "meshdir", value(a, "assetdir", meshes_));
    order_ = value(a, "eulerseq", order_);
    if (order_.size() != 3 || order_.find_first_not_of("xyzXYZ") != std::string::npos)
      fail(node, "eulerseq must be three of x, y, z, X, Y and Z");
    strip_path_ = value(a, "strippath", strip_path_ ? "true" : "false") == "true";
    auto_limits_ = value(a, "autolimits", auto_limits_ ? "true" : "false") == "true";
  }

  using Class = std::map<std::string, Attributes>;  ///< by kind of element

  void read_defaults(const Node& node, const std::string& parent) {
    const std::string name = value(node.attributes, "class", parent.empty() ? "main" : "");
    Class own = defaults_[parent];
    for (const Node& child : node.children)
      if (child.name != "default") replace(child.attributes, own[child.name]);
    defaults_[name] = own;
    if (parent.empty()) defaults_[""] = own;  // the class at the top, whatever it is called
    for (const Node& child : node.children)
      if (child.name == "default") read_defaults(child, name);
  }

  Attributes with_defaults(const Node& node, const std::string& child_class) const {
    const std::string name = value(node.attributes, "class", child_class);
    const auto found = defaults_.find(name);
    if (found == defaults_.end()) fail(node, "its class " + in_quotes(name) + " is not defined");
    const auto kind = found->second.find(node.name);
    Attributes all = kind == found->second.end() ? Attributes{} : kind->second;
    replace(node.attributes, all);
    return all;
  }

  /// Any orientation replaces another; a size replaces as many numbers as it has.
  static void replace(const Attributes& by, Attributes& all) {
    if (std::any_of(std::begin(kTurns), std::end(kTurns),
                    [&](const char* key) { return by.contains(key); }))
      for (const char* const key : kTurns) all.erase(key);
    std::size_t sizes = 0;
    std::string rest;
    for_words(value(by, "size"), [&](std::string_view) { ++sizes; });
    for_words(value(all, "size"), [&](std::string_view word) {
      if (sizes > 0 && sizes-- > 0) return;
      (rest += ' ') += word;
    });
    for (const auto& [key, text] : by) all[key] = key == "size" ? text + rest : text;
  }

  void read_mesh(const Node& node) {
    const Attributes a = with_defaults(node, "");
    std::string file = value(a, "file");
    if (strip_path_) file = fs::path(file).filename().string();
    const std::string name = value(a, "name", fs::path(file).stem().string());
    if (meshes_by_name_.contains(name)) fail(node, "duplicates the mesh " + in_quotes(name));
    PlacedLinkShape& shape = meshes_by_name_[name];
    if (file.empty()) {
      shape.shape = LinkFault{node.where + ": has no file; write its vertices into one"};
      return;
    }
    LinkMesh mesh;
    mesh.file = (fs::path(meshes_) / file).string();
    mesh.scale = vector(node, a, "scale", Vector3d::Ones());
    shape.shape = mesh;
    // MuJoCo scales the mesh last; its mirrors are exchanged with the turn.
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    if (a.contains("refquat"))
      turn = quaternion(node, a.at("refquat")).conjugate().toRotationMatrix();
    const Vector3d mirror = mesh.scale.cwiseSign();
    shape.translation =
        -mesh.scale.cwiseProduct(turn * vector(node, a, "refpos", Vector3d::Zero()));
    shape.rotation = mirror.asDiagonal() * turn * mirror.asDiagonal();
    const Vector3d size = mesh.scale.cwiseAbs();
    if (!turn.isIdentity(0) && size.maxCoeff() > (1 + 1e-12) * size.minCoeff())
      shape.shape = LinkFault{node.where +
                              ": a scale that differs by axis is not read with a refquat. Write "
                              "the turned vertices into a file"};
  }

  Eigen::Quaterniond quaternion(const Node& node, const std::string& text) const {
    const std::vector<double> q = numbers(node, "quat", text);
    if (q.size() != 4 || Eigen::Map<const Eigen::Vector4d>(q.data()).norm() == 0)
      fail(node, "quat must have 4 numbers, not all 0");
    return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
  }

  Eigen::Quaterniond rotation(const Node& node, const Attributes& a) const {
    const Eigen::Quaterniond turn = stated_rotation(node, a);
    if (!(std::abs(turn.norm() - 1) < 1e-6))
      fail(node, "an axis of its rotation is 0, or both of xyaxes are parallel");
    return turn;
  }
  Eigen::Quaterniond stated_rotation(const Node& node, const Attributes& a) const {
    const auto given = [&](const char* key, std::size_t count) {
      const std::vector<double> v = numbers(node, key, a.at(key));
      if (v.size() != count)
        fail(node, std::string(key) + " must have " + std::to_string(count) + " numbers");
      return v;
    };
    if (a.contains("quat")) return quaternion(node, a.at("quat"));
    if (a.contains("axisangle")) {
      const std::vector<double> v = given("axisangle", 4);
      return Eigen::Quaterniond(
          Eigen::AngleAxisd(angle(v[3]), Vector3d(v[0], v[1], v[2]).normalized()));
    }
    if (a.contains("euler")) {
      const std::vector<double> v = given("euler", 3);
      Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
      for (std::size_t i = 0; i < 3; ++i) {
        const bool moving = order_[i] >= 'a';  // axes: small letters move along
        const Eigen::Quaterniond turn(
            Eigen::AngleAxisd(angle(v[i]), Vector3d::Unit(order_[i] - (moving ? 'x' : 'X'))));
        q = moving ? q * turn : turn * q;
      }
      return q;
    }
    if (a.contains("xyaxes")) {
      const std::vector<double> v = given("xyaxes", 6);
      Eigen::Matrix3d m;
      m.col(0) = Vector3d(v[0], v[1], v[2]).normalized();
      const Vector3d y(v[3], v[4], v[5]);
      m.col(1) = (y - y.dot(m.col(0)) * m.col(0)).normalized();
      m.col(2) = m.col(0).cross(m.col(1));
      return Eigen::Quaterniond(m);
    }
    if (a.contains("zaxis")) {
      const std::vector<double> v = given("zaxis", 3);
      return turn_from_z(Vector3d(v[0], v[1], v[2]));
    }
    return Eigen::Quaterniond::Identity();
  }

  Eigen::Isometry3d pose(const Node& node, const Attributes& a) const {
    return Eigen::Translation3d(vector(node, a, "pos", Vector3d::Zero())) * rotation(node, a);
  }

  std::size_t add_link(const std::string& name, std::size_t parent, RobotJoint joint) {
    const std::size_t link = robot_.links.size();
    robot_.links.emplace_back().name = name;
    robot_.joint_of.push_back(parent == kNone ? kNone : robot_.joints.size());
    if (parent == kNone) return link;
    joint.parent = parent;
    joint.child = link;
    robot_.joints.push_back(std::move(joint));
    return link;
  }

  void read_body(const Node& node, std::size_t parent, const std::string& outer_class) {
    const std::string own_class = value(node.attributes, "childclass", outer_class);
    const std::string name =
        value(node.attributes, "name", "body_" + std::to_string(robot_.links.size()));
    if (!bodies_.emplace(name, 0).second)
      fail(node, "duplicates the body " + in_quotes(name) + ". Rename one of them");
    std::vector<RobotJoint> joints;
    RobotJoint fixed;
    fixed.name = name + "_fixed";
    Eigen::Isometry3d from = pose(node, node.attributes);  // the last joint's frame to the next's
    for (const Node& child : node.children) {
      if (child.name != "joint" && child.name != "freejoint") continue;
      const Attributes a = with_defaults(child, own_class);
      fixed.taken_as_fixed = child.name == "freejoint" || value(a, "type") == "free";
      if (fixed.taken_as_fixed)
        fixed.name = value(a, "name", fixed.name);
      else
        add_joints(child, a, from, joints);
    }
    if (joints.empty() || !from.isApprox(Eigen::Isometry3d::Identity(), 0)) {
      fixed.origin = from;
      joints.push_back(fixed);
    }
    std::size_t link = parent;
    for (std::size_t k = 0; k < joints.size(); ++k)
      link = add_link(k + 1 == joints.size() ? name : name + "_before_" + joints[k + 1].name, link,
                      joints[k]);
    bodies_[name] = link;
    read_inside(node, link, own_class);
  }

  /// Joints of an element; `from` is the pose of the frame in which the next one is described.
  void add_joints(const Node& node, const Attributes& a, Eigen::Isometry3d& from,
                  std::vector<RobotJoint>& joints) {
    const std::string type = value(a, "type", "hinge");
    const Vector3d at = vector(node, a, "pos", Vector3d::Zero());
    RobotJoint joint;
    joint.name = value(a, "name", "joint_" + std::to_string(robot_.joints.size() + joints.size()));
    joint.axis = vector(node, a, "axis", Vector3d::UnitZ());
    if (joint.axis.norm() == 0) fail(node, "its axis has the length 0");
    joint.axis.normalize();
    joint.lower = -std::numbers::pi;
    joint.upper = std::numbers::pi;
    const std::string limited = value(a, "limited", "auto");
    const std::vector<double> range = numbers(node, "range", value(a, "range"));
    const bool empty = range.size() == 2 && range[0] == range[1];
    const bool has_range =
        !range.empty() && (limited == "true" || (limited == "auto" && auto_limits_ && !empty));
    if (has_range && type != "ball") {
      if (range.size() != 2 || range[0] > range[1])
        fail(node, "range must have 2 numbers, the smaller first");
      joint.lower = type == "hinge" ? angle(range[0]) : range[0];
      joint.upper = type == "hinge" ? angle(range[1]) : range[1];
    }
    joint.origin = from * Eigen::Translation3d(at);
    from = Eigen::Translation3d(-at) * Eigen::Isometry3d::Identity();
    if (type == "hinge" || type == "slide") {
      const std::vector<double> ref = numbers(node, "ref", value(a, "ref", "0"));
      const double zero = ref.empty() ? 0 : type == "hinge" ? angle(ref[0]) : ref[0];
      zeros_[joint.name] = zero;
      if (type == "hinge") {
        joint.motion = RobotJoint::Motion::turning;
        joint.origin = joint.origin * Eigen::AngleAxisd(-zero, joint.axis);
      } else {
        if (has_range) joint.motion = RobotJoint::Motion::sliding;
        joint.taken_as_fixed = !has_range;
        joint.origin = joint.origin * Eigen::Translation3d(-zero * joint.axis);
      }
      joints.push_back(joint);
    } else if (type == "ball") {
      for (int k = 0; k < 3; ++k) {
        RobotJoint hinge = joint;
        hinge.motion = RobotJoint::Motion::turning;
        hinge.name += std::string("_") + "xyz"[k];
        hinge.axis = Vector3d::Unit(k);
        if (k > 0) hinge.origin = Eigen::Isometry3d::Identity();
        joints.push_back(hinge);
      }
    } else {
      fail(node, "its type " + in_quotes(type) + " is unknown. Use hinge, slide, ball or free");
    }
  }

  /// Geoms and bodies, also in frames.
  void read_inside(const Node& node, std::size_t link, const std::string& own_class) {
    for (const Node& child : node.children) {
      if (child.name == "geom") read_geom(child, link, own_class);
      if (child.name == "body") read_body(child, link, own_class);
      if (child.name == "flexcomp")
        robot_.endless.push_back(value(child.attributes, "name", child.name));
      if (child.name == "frame" || child.name == "replicate" || child.name == "attach" ||
          child.name == "composite")
        fail(child, "is not read. Save the model from MuJoCo (mj_saveLastXML), which resolves it");
    }
  }

  void read_geom(const Node& node, std::size_t link, const std::string& own_class) {
    const Attributes a = with_defaults(node, own_class);
    const bool visual = value(a, "contype", "1") == "0" && value(a, "conaffinity", "1") == "0";
    const std::string type = value(a, "type", "sphere");
    if (type == "plane" || type == "hfield") {
      if (!visual)
        robot_.endless.push_back(value(a, "name", type + " of " + robot_.links[link].name));
      return;
    }
    PlacedLinkShape placed;
    try {
      placed = shape_of(node, a, type);
    } catch (const Error& error) {
      placed.shape = LinkFault{error.what()};
    }
    RobotLink& to = robot_.links[link];
    (visual ? to.visual : to.collision).push_back(std::move(placed));
  }

  PlacedLinkShape shape_of(const Node& node, const Attributes& a, const std::string& type) const {
    PlacedLinkShape placed;
    Eigen::Isometry3d at = pose(node, a);
    std::vector<double> size = numbers(node, "size", value(a, "size"));
    if (type == "mesh") {
      const auto found = meshes_by_name_.find(value(a, "mesh"));
      if (found == meshes_by_name_.end())
        fail(node, "its mesh " + in_quotes(value(a, "mesh")) + " is not an asset");
      placed = found->second;
      at = at * Eigen::Translation3d(placed.translation) * placed.rotation;
    } else {
      if (a.contains("mesh"))
        fail(node, "a primitive fitted to a mesh is not read. Use type=\"mesh\"");
      if (a.contains("fromto")) {
        const std::vector<double> v = numbers(node, "fromto", a.at("fromto"));
        if (v.size() != 6 || size.empty()) fail(node, "fromto must have 6 numbers, and size one");
        const Vector3d begin(v[0], v[1], v[2]), end(v[3], v[4], v[5]);
        at = Eigen::Translation3d((begin + end) / 2) * turn_from_z(begin - end);
        const double half = (end - begin).norm() / 2;
        size = type == "box" || type == "ellipsoid" ? std::vector<double>{size[0], size[0], half}
                                                    : std::vector<double>{size[0], half};
      }
      const std::size_t count = type == "box" || type == "ellipsoid" ? 3 : type == "sphere" ? 1 : 2;
      if (size.size() < count ||
          !std::all_of(size.begin(), size.begin() + static_cast<std::ptrdiff_t>(count),
                       [](double x) { return x > 0; }))
        fail(node, "size must have " + std::to_string(count) + " numbers above 0");
      if (type == "box")
        placed.shape = LinkBox{{size[0], size[1], size[2]}};
      else if (type == "sphere")
        placed.shape = LinkBall{size[0]};
      else if (type == "capsule")
        placed.shape = LinkCapsule{size[0], size[1]};
      else if (type == "cylinder")
        placed.shape = LinkCylinder{size[0], size[1]};
      else if (type == "ellipsoid")
        placed.shape = LinkEllipsoid{{size[0], size[1], size[2]}};
      else
        fail(node, "its type " + in_quotes(type) +
                       " is not read. Use mesh, box, sphere, capsule, cylinder or ellipsoid");
    }
    placed.rotation = Eigen::Quaterniond(at.linear());
    placed.translation = at.translation();
    placed.line = node.line;
    return placed;
  }

  void read_contact(const Node& node) {
    for (const Node& child : node.children) {
      if (child.name != "exclude") continue;
      std::array<std::size_t, 2> pair{};
      for (std::size_t k = 0; k < 2; ++k) {
        const std::string name = value(child.attributes, k == 0 ? "body1" : "body2");
        const auto found = bodies_.find(name);
        if (name != "world" && found == bodies_.end())
          fail(child, in_quotes(name) + " is not a body");
        pair[k] = name == "world" ? 0 : found->second;
      }
      robot_.excluded.emplace_back(pair[0], pair[1]);
    }
  }

  void read_equality(const Node& node) {
    for (const Node& child : node.children) {
      const Attributes& a = child.attributes;
      if (child.name != "joint" || !a.contains("joint2") || value(a, "active") == "false") continue;
      const std::size_t one = index_named(robot_.joints, value(a, "joint1")),
                        by = index_named(robot_.joints, a.at("joint2"));
      if (one == robot_.joints.size() || by == robot_.joints.size() ||
          !robot_.joints[one].is_free() || robot_.joints[by].motion == RobotJoint::Motion::fixed)
        continue;
      std::vector<double> c = numbers(child, "polycoef", value(a, "polycoef", "0"));
      if (c.size() == 1) c.push_back(1);
      if (c.empty() || std::any_of(c.begin() + 2, c.end(), [](double x) { return x != 0; }))
        continue;
      // Positions are counted from where the bodies stand in the file.
      follow(robot_.joints, one, by, c[1],
             zeros_[robot_.joints[one].name] + c[0] - c[1] * zeros_[robot_.joints[by].name]);
    }
  }

  RobotModel& robot_;
  fs::path folder_;
  std::deque<SourceFile> included_;  ///< being read
  bool degrees_ = true, auto_limits_ = true, strip_path_ = false;
  std::string meshes_, order_ = "xyz";
  std::map<std::string, Class> defaults_;
  std::map<std::string, PlacedLinkShape> meshes_by_name_;
  std::map<std::string, std::size_t> bodies_;
  std::map<std::string, double> zeros_;  ///< positions of joints in the file, if not 0
};

}  // namespace

RobotModel read_mjcf(SourceFile file) {
  RobotModel robot;
  robot.file = std::move(file);
  robot.is_urdf = false;
  MjcfReader(robot).read();
  return robot;
}

}  // namespace ist
