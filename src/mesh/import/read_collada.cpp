#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <unordered_map>
#include <utility>

#include "mesh/import/collada_document.h"
#include "mesh/import/text_scanner.h"

namespace ist {
namespace {

using Transform = Eigen::Affine3d;
using Index = ColladaDocument::Index;

/// Sine and cosine of degrees by + − × ÷ alone: the same on every machine; exact at multiples of
/// 90°.
std::pair<double, double> sine_and_cosine(double degrees) {
  const double turned = std::fmod(degrees, 360.0);  // exact
  const double quarter = std::round(turned / 90);
  const double x = (turned - 90 * quarter) * (std::numbers::pi / 180);  // |x| ≤ π/4
  double sine = 0, cosine = 0;
  for (int k = 10; k >= 0; --k) {  // Horner of the Taylor series
    sine = 1 - x * x / ((2 * k + 2) * (2 * k + 3)) * sine;
    cosine = 1 - x * x / ((2 * k + 1) * (2 * k + 2)) * cosine;
  }
  sine *= x;
  switch (static_cast<int>(quarter) & 3) {
    case 0:
      return {sine, cosine};
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    default:
      return {-cosine, sine};
  }
}

class SceneReader {
 public:
  explicit SceneReader(const SourceFile& file)
      : document_(file), xml_(document_.xml()), geometries_(document_) {}

  PolygonMesh read() {
    const Index scene = visual_scene();
    out_.declared = declared_frame();
    open_nodes_below(scene, root_transform());
    while (!open_.empty()) {
      const auto [node, parent] = open_.back();
      open_.pop_back();
      const Transform world = parent * local_transform(node);
      for (Index child = xml_[node].first_child; child != kNoElement;
           child = xml_[child].next_sibling) {
        if (xml_[child].name == "instance_geometry")
          append(document_.target(child, "url", "geometry"), world, child);
        else if (xml_[child].name == "instance_controller")
          append_controller(child, world);
      }
      open_nodes_below(node, world);
    }
    return std::move(out_);
  }

 private:
  void open_nodes_below(Index element, const Transform& parent) {
    for (Index child = xml_[element].first_child; child != kNoElement;
         child = xml_[child].next_sibling) {
      if (++steps_ > kMostInstances + xml_.size())
        xml_.fail(
            child,
            "too many nodes, each counted once per instance. Check that no node contains itself");
      if (xml_[child].name == "node")
        open_.emplace_back(child, parent);
      else if (xml_[child].name == "instance_node")
        open_.emplace_back(document_.target(child, "url", "node"), parent);
    }
  }

  Index visual_scene() const {
    const Index scene = xml_.child(0, "scene");
    const Index instance =
        scene == kNoElement ? kNoElement : xml_.child(scene, "instance_visual_scene");
    if (instance != kNoElement) return document_.target(instance, "url", "visual_scene");
    const Index library = xml_.child(0, "library_visual_scenes");
    const Index first = library == kNoElement ? kNoElement : xml_.child(library, "visual_scene");
    if (first == kNoElement) xml_.fail(0, "contains no visual scene. Export one");
    return first;
  }

  /// Reads <asset>. The up axis is reported, but coordinates are not rotated by it: a robot's
  /// visual DAE must match its collision STL.
  DeclaredFrame declared_frame() const {
    DeclaredFrame frame;
    const Index asset = xml_.child(0, "asset");
    if (asset == kNoElement) return frame;
    const Index axis = xml_.child(asset, "up_axis"), unit = xml_.child(asset, "unit");
    const std::string_view up = axis == kNoElement ? "" : xml_[axis].text;
    for (const char letter : {'X', 'Y', 'Z'})
      if (up.find(std::string{letter} + "_UP") != std::string_view::npos) frame.up_axis = letter;
    const std::string_view meter = unit == kNoElement ? "" : xml_.attribute(unit, "meter");
    if (meter.empty()) return frame;
    const std::optional<double> scale = parse_real(meter);
    if (!scale || !(*scale > 0)) xml_.fail(unit, in_quotes(meter) + " is not a length in metres");
    frame.unit = *scale;
    frame.converted = true;
    return frame;
  }

  /// The scale to metres.
  Transform root_transform() const {
    Transform transform = Transform::Identity();
    if (out_.declared.unit != 0) transform.linear() *= out_.declared.unit;
    return transform;
  }

  /// The transform of a node, read once however often the node is visited.
  const Transform& local_transform(Index node) {
    const auto [found, is_new] = transforms_.try_emplace(node, Transform::Identity());
    if (!is_new) return found->second;
    Transform& transform = found->second;
    for (Index child = xml_[node].first_child; child != kNoElement;
         child = xml_[child].next_sibling) {
      const std::string_view name = xml_[child].name;
      if (name == "matrix") {
        transform = transform * matrix(child);
      } else if (name == "translate") {
        transform.translate(Eigen::Vector3d(document_.reals(child, 3).data()));
      } else if (name == "scale") {
        transform.scale(Eigen::Vector3d(document_.reals(child, 3).data()));
      } else if (name == "rotate") {
        transform.rotate(rotation(child));
      } else if (name == "skew" || name == "lookat") {
        if (xml_.child(node, "camera") == kNoElement &&
            xml_.child(node, "instance_camera") == kNoElement &&
            xml_.child(node, "instance_light") == kNoElement)
          xml_.fail(child, "is not supported. Export it with matrices");
      }
    }
    return transform;
  }

  Transform matrix(Index element) const {
    const std::vector<double> m = document_.reals(element, 16);  // by rows
    if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1)
      xml_.fail(element, "a projection, not a transform");
    Transform result;
    result.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(m.data());
    return result;
  }

  Eigen::Matrix3d rotation(Index element) const {
    const std::vector<double> r = document_.reals(element, 4);  // axis, degrees
    const Eigen::Vector3d axis(r.data());
    if (!(axis.norm() > 0) || !axis.allFinite() || !std::isfinite(r[3]))
      xml_.fail(element, "no axis and angle to rotate by");
    const auto [sine, cosine] = sine_and_cosine(r[3]);
    const Eigen::Vector3d u = axis / axis.norm();
    Eigen::Matrix3d cross;
    cross << 0, -u[2], u[1], u[2], 0, -u[0], -u[1], u[0], 0;
    return Eigen::Matrix3d::Identity() + sine * cross + (1 - cosine) * cross * cross;  // Rodrigues
  }

  /// Appends a skinned mesh in its bind pose, which its skin places, not its node.
  void append_controller(Index instance, const Transform& world) {
    const Index controller = document_.target(instance, "url", "controller");
    const auto [found, is_new] = controllers_.try_emplace(controller);
    Controlled& controlled = found->second;
    if (is_new) {
      const Index skin = xml_.child(controller, "skin"), morph = xml_.child(controller, "morph");
      if (skin == kNoElement && morph == kNoElement)
        xml_.fail(controller, "is neither skin nor morph");
      if (skin == kNoElement)
        out_.notes.emplace_back("morph targets are not applied: the base mesh is read");
      controlled.geometry =
          document_.target(skin == kNoElement ? morph : skin, "source", "geometry");
      if (skin != kNoElement) {
        const Index bind = xml_.child(skin, "bind_shape_matrix");
        out_.notes.emplace_back("a skin is not posed: its mesh is read as it was modelled");
        controlled.pose =
            bind == kNoElement ? root_transform() : Transform(root_transform() * matrix(bind));
      }
    }
    append(controlled.geometry, controlled.pose.value_or(world), instance);
  }

  void append(Index element, const Transform& world, Index instance) {
    const PolygonMesh& mesh = geometries_[element];
    out_.notes.insert(out_.notes.end(), mesh.notes.begin(), mesh.notes.end());
    if (out_.corners.size() + mesh.corners.size() > document_.most() ||
        out_.vertices.size() + mesh.vertices.size() >
            std::min<std::size_t>(document_.most(), UINT32_MAX))
      xml_.fail(instance, "the nodes repeat the meshes to more than " +
                              std::to_string(document_.most()) +
                              " corners. Flatten or split the scene");
    const auto first = static_cast<Index>(out_.vertices.size());
    for (const Eigen::Vector3d& v : mesh.vertices) out_.vertices.push_back(world * v);
    // A mirror turns every face inside out; this reverses it.
    const bool mirrored = world.linear().determinant() < 0;
    std::size_t begin = 0;
    for (const std::size_t end : mesh.ends) {
      for (std::size_t i = begin; i < end; ++i)
        out_.corners.push_back(first + mesh.corners[mirrored ? end - 1 - (i - begin) : i]);
      out_.ends.push_back(out_.corners.size());
      begin = end;
    }
  }

  /// A limit of instances: a small file can instance its nodes many times, but more is malicious or
  /// damaged.
  static constexpr std::size_t kMostInstances = 1'000'000;

  struct Controlled {
    Index geometry = kNoElement;
    std::optional<Transform> pose;  ///< a skin's
  };

  const ColladaDocument document_;
  const XmlDocument& xml_;
  ColladaGeometries geometries_;
  std::unordered_map<Index, Transform> transforms_;
  std::unordered_map<Index, Controlled> controllers_;
  std::vector<std::pair<Index, Transform>> open_;  ///< nodes to visit, with their parents' frames
  std::size_t steps_ = 0;
  PolygonMesh out_;
};

}  // namespace

PolygonMesh read_collada(const SourceFile& file) { return SceneReader(file).read(); }

}  // namespace ist
