#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "base/message_text.h"
#include "mesh/import/gltf_document.h"
#include "mesh/import/polygon_mesh.h"

namespace ist {
namespace {

using Json = GltfDocument::Json;
using Transform = Eigen::Affine3d;

Transform placed(const GltfDocument& document, const double* t, const double* r, const double* s,
                 const std::string& name) {
  const Eigen::Quaterniond rotation(r[3], r[0], r[1], r[2]);
  if (!(rotation.norm() > 0)) document.fail(name + ": its rotation is zero");
  Transform transform = Transform::Identity();
  transform.translate(Eigen::Vector3d(t));
  transform.rotate(rotation.normalized());
  transform.scale(Eigen::Vector3d(s));
  return transform;
}

/// Makes a transform from 16 numbers by columns.
Transform affine(const GltfDocument& document, const double* m, const std::string& name) {
  if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)
    document.fail(name + ": its matrix is a projection, not a transform");
  Transform transform;
  transform.matrix() = Eigen::Map<const Eigen::Matrix4d>(m);
  return transform;
}

std::vector<double> reals(const GltfDocument& document, const Json& list, const std::string& name) {
  std::vector<double> values;
  for (const Json& value : list) values.push_back(document.real(value, name));
  return values;
}

Transform local_transform(const GltfDocument& document, const Json& node, const std::string& name) {
  const auto numbers = [&](const char* key, const std::vector<double>& fallback) {
    if (!node.contains(key)) return fallback;
    std::vector<double> values = reals(document, node.at(key), name);
    if (values.size() != fallback.size())
      document.fail(name + ": its " + key + " has " + std::to_string(values.size()) + " numbers");
    return values;
  };
  if (node.contains("matrix"))
    return affine(document, numbers("matrix", std::vector<double>(16)).data(), name);
  const std::vector<double> t = numbers("translation", {0, 0, 0});
  const std::vector<double> r = numbers("rotation", {0, 0, 0, 1});  // x y z w
  const std::vector<double> s = numbers("scale", {1, 1, 1});
  return placed(document, t.data(), r.data(), s.data(), name);
}

/// True if a number has more digits than a float32, whether written as a decimal or as its exact
/// double.
bool is_certainly_double(double x) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, x, std::chars_format::general, 9).ptr;
  double rounded = x;
  std::from_chars(text, end, rounded);
  return rounded != x && static_cast<double>(static_cast<float>(x)) != x;
}

/// The copies of a node's mesh by EXT_mesh_gpu_instancing, in the node's frame; without it, one
/// identity transform.
std::vector<Transform> instances(const GltfDocument& document, const Json& node,
                                 const std::string& name) {
  constexpr const char* kExtension = "EXT_mesh_gpu_instancing";
  if (!node.contains("extensions") || !node.at("extensions").contains(kExtension))
    return {Transform::Identity()};
  const Json& attributes = node.at("extensions").at(kExtension).at("attributes");
  const auto read = [&](const char* key, std::string_view type) {
    if (!attributes.contains(key)) return std::vector<double>();
    return document.accessor(document.whole(attributes, key), type, name);
  };
  const std::vector<double> t = read("TRANSLATION", "VEC3"), r = read("ROTATION", "VEC4"),
                            s = read("SCALE", "VEC3");
  const std::size_t count = std::max({t.size() / 3, r.size() / 4, s.size() / 3});
  const auto fits = [&](const std::vector<double>& values, std::size_t width) {
    return values.empty() || values.size() == width * count;
  };
  if (count == 0 || !fits(t, 3) || !fits(r, 4) || !fits(s, 3))
    document.fail(name + ": its instances need one translation, rotation or scale each");
  if (node.contains("skin"))
    document.fail(name + ": has a skin and instances, of which glTF does not say what they mean");
  constexpr double kZeros[3] = {0, 0, 0}, kTurn[4] = {0, 0, 0, 1}, kOnes[3] = {1, 1, 1};
  std::vector<Transform> result;
  result.reserve(count);
  for (std::size_t i = 0; i < count; ++i)
    result.push_back(placed(document, t.empty() ? kZeros : &t[3 * i], r.empty() ? kTurn : &r[4 * i],
                            s.empty() ? kOnes : &s[3 * i], name));
  return result;
}

std::vector<std::uint32_t> corner_indices(const GltfDocument& document, const Json& primitive,
                                          std::size_t vertex_count, const std::string& name) {
  std::vector<std::uint32_t> indices;
  if (!primitive.contains("indices")) {
    for (std::size_t i = 0; i < vertex_count; ++i) indices.push_back(static_cast<std::uint32_t>(i));
    return indices;
  }
  const std::size_t accessor = document.whole(primitive, "indices");
  for (const double value : document.accessor(accessor, "SCALAR", name)) {
    if (!(value >= 0 && value < static_cast<double>(vertex_count)) || value != std::floor(value))
      document.fail("accessor " + std::to_string(accessor) + " names vertex " + shortest(value) +
                    " of " + std::to_string(vertex_count));
    indices.push_back(static_cast<std::uint32_t>(value));
  }
  return indices;
}

/// A primitive in the node's frame.
struct Primitive {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

Primitive read_primitive(const GltfDocument& document, const Json& json, const std::string& name) {
  enum : std::size_t { kTriangles = 4, kStrip = 5, kFan = 6 };
  const std::size_t mode = document.whole(json, "mode", kTriangles);
  if (mode > kFan) document.fail(name + ": unknown primitive mode " + std::to_string(mode));
  if (mode < kTriangles || !json.at("attributes").contains("POSITION")) return {};  // no surface
  const std::vector<double> positions =
      document.accessor(document.whole(json.at("attributes"), "POSITION"), "VEC3", name);
  Primitive primitive;
  for (std::size_t i = 0; i < positions.size(); i += 3)
    primitive.vertices.emplace_back(&positions[i]);
  const std::vector<std::uint32_t> indices =
      corner_indices(document, json, primitive.vertices.size(), name);
  if (mode == kTriangles && indices.size() % 3 != 0)
    document.fail(name + ": " + std::to_string(indices.size()) +
                  " corners are not a multiple of three");
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    primitive.triangles.push_back({a, b, c});
  };
  if (mode == kTriangles)
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3)
      add(indices[i], indices[i + 1], indices[i + 2]);
  for (std::size_t i = 0; mode == kStrip && i + 2 < indices.size(); ++i)
    add(indices[i], indices[i + 1 + i % 2], indices[i + 2 - i % 2]);
  for (std::size_t i = 1; mode == kFan && i + 1 < indices.size(); ++i)
    add(indices[0], indices[i], indices[i + 1]);
  return primitive;
}

/// Moves vertices by Σ weight · morph target. The node's weights override its mesh's.
void morph(const GltfDocument& document, const Json& json, const std::vector<double>& weights,
           const std::string& name, Primitive& primitive) {
  if (!json.contains("targets") || weights.empty()) return;
  const Json& targets = json.at("targets");
  if (targets.size() != weights.size())
    document.fail(name + ": " + std::to_string(weights.size()) + " weights for " +
                  std::to_string(targets.size()) + " morph targets");
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] == 0 || !targets[i].contains("POSITION")) continue;
    const std::vector<double> moves =
        document.accessor(document.whole(targets[i], "POSITION"), "VEC3", name);
    if (moves.size() != 3 * primitive.vertices.size())
      document.fail(name + ": morph target " + std::to_string(i) +
                    " has another number of "
                    "vertices than its primitive");
    for (std::size_t v = 0; v < primitive.vertices.size(); ++v)
      primitive.vertices[v] += weights[i] * Eigen::Vector3d(&moves[3 * v]);
  }
}

/// Reverses a triangle of a mirrored face.
void turn(std::array<std::uint32_t, 3>& triangle) { std::swap(triangle[1], triangle[2]); }

/// Moves vertices by their joints: Σ weight · joint. A vertex's joints are summed in order of their
/// numbers, so that its copies at a seam, which may list them in another order, stay together.
void pose(const GltfDocument& document, const Json& json, const std::vector<Transform>& joints,
          const std::string& name, Primitive& primitive) {
  using Weight = std::pair<std::size_t, double>;  // by joint
  std::vector<std::vector<Weight>> of_vertex(primitive.vertices.size());
  const Json& attributes = json.at("attributes");
  for (int set = 0;; ++set) {
    const std::string number = std::to_string(set);
    if (!attributes.contains("JOINTS_" + number)) break;
    const std::vector<double> names =
        document.accessor(document.whole(attributes, "JOINTS_" + number), "VEC4", name);
    const std::vector<double> weights =
        document.accessor(document.whole(attributes, "WEIGHTS_" + number), "VEC4", name);
    if (names.size() != 4 * of_vertex.size() || weights.size() != names.size())
      document.fail(name + ": joints and weights of another number of vertices");
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (!(std::abs(weights[i]) > 0)) continue;
      if (!(names[i] < static_cast<double>(joints.size())) || !(weights[i] < HUGE_VAL))
        document.fail(name + ": vertex " + std::to_string(i / 4) + " hangs on joint " +
                      shortest(names[i]) + " of " + std::to_string(joints.size()) +
                      " with a weight of " + shortest(weights[i]));
      of_vertex[i / 4].emplace_back(static_cast<std::size_t>(names[i]), weights[i]);
    }
  }
  std::vector<bool> mirrored(primitive.vertices.size());
  for (std::size_t v = 0; v < of_vertex.size(); ++v) {
    std::sort(of_vertex[v].begin(), of_vertex[v].end());
    double sum = 0;
    Eigen::Matrix4d blended = Eigen::Matrix4d::Zero();
    for (const auto& [joint, weight] : of_vertex[v]) {
      sum += weight;
      blended += weight * joints[joint].matrix();
    }
    if (!(sum > 0))
      document.fail(name + ": vertex " + std::to_string(v) +
                    " has a skin and no weights. Normalise the weights");
    const Transform place(Eigen::Matrix4d(blended / sum));
    primitive.vertices[v] = place * primitive.vertices[v];
    mirrored[v] = place.linear().determinant() < 0;
  }
  for (auto& triangle : primitive.triangles)
    if (mirrored[triangle[0]]) turn(triangle);
}

void append(const GltfDocument& document, const Primitive& primitive, const Transform& world,
            PolygonMesh& out) {
  if (out.corners.size() + 3 * primitive.triangles.size() > document.most_corners() ||
      out.vertices.size() + primitive.vertices.size() >
          std::min<std::size_t>(document.most_corners(), UINT32_MAX))
    document.fail("its nodes repeat its meshes to more than " +
                  std::to_string(document.most_corners()) + " corners. Flatten or split the scene");
  const auto first = static_cast<std::uint32_t>(out.vertices.size());
  for (const Eigen::Vector3d& vertex : primitive.vertices) out.vertices.push_back(world * vertex);
  const bool mirrored = world.linear().determinant() < 0;
  for (std::array<std::uint32_t, 3> t : primitive.triangles) {
    if (mirrored) turn(t);
    out.add_triangle(first + t[0], first + t[1], first + t[2]);
  }
}

std::vector<std::size_t> root_nodes(const GltfDocument& document) {
  std::vector<std::size_t> roots;
  const Json& root = document.root();
  if (root.contains("scenes")) {
    const Json& scene = document.at("scenes", document.whole(root, "scene", 0), "the file");
    return document.whole_list(scene, "nodes");
  }
  // Without a scene: every node that is not a child.
  const Json nodes = root.value("nodes", Json::array());
  std::vector<bool> is_child(nodes.size(), false);
  for (const Json& node : nodes)
    for (const std::size_t child : document.whole_list(node, "children"))
      if (child < is_child.size()) is_child[child] = true;
  for (std::size_t i = 0; i < is_child.size(); ++i)
    if (!is_child[i]) roots.push_back(i);
  return roots;
}

class GltfScene {
 public:
  explicit GltfScene(const SourceFile& file) : document_(file) {}

  PolygonMesh read() {
    mesh_.declared = {.up_axis = 'Y', .unit = 1};  // every glTF file, by its specification
    place_nodes();
    for (const std::size_t node : in_order_)
      if (has_mesh(node)) append_node(node, world_places(node), mesh_);
    note_unread();
    return std::move(mesh_);
  }

  GltfParts read_parts() {
    place_nodes();
    GltfParts out;
    std::map<std::size_t, std::size_t> shared;  // by the file's mesh
    for (const std::size_t index : in_order_) {
      for (const char* const key : {"matrix", "translation", "rotation", "scale"})
        for (const Json& number : document_.root().at("nodes")[index].value(key, Json::array()))
          out.of_doubles = out.of_doubles || is_certainly_double(number.get<double>());
      if (!has_mesh(index)) continue;
      const Json& node = document_.root().at("nodes")[index];
      const bool own = node.contains("weights") || node.contains("skin");
      const std::size_t mesh = document_.whole(node, "mesh");
      const auto [known, fresh] = shared.try_emplace(mesh, out.meshes.size());
      const std::size_t at = own || fresh ? out.meshes.size() : known->second;
      if (own && fresh) shared.erase(known);
      if (at == out.meshes.size())
        append_node(index, {Transform::Identity()}, out.meshes.emplace_back());
      const std::vector<Transform> places = world_places(index);
      const std::string given = node.value("name", std::string());
      const std::string name = given.empty() ? "node " + std::to_string(index) : given;
      for (std::size_t i = 0; i < places.size(); ++i)
        out.parts.push_back(
            {places.size() > 1 ? name + "[" + std::to_string(i) + "]" : name, at, places[i]});
    }
    note_unread();
    out.notes = std::move(mesh_.notes);
    return out;
  }

 private:
  bool has_mesh(std::size_t index) const {
    return document_.root().at("nodes")[index].contains("mesh");
  }

  /// Computes the frames of the scene's nodes, each after its parent.
  void place_nodes() {
    worlds_.resize(document_.root().value("nodes", Json::array()).size());
    std::vector<std::pair<std::size_t, Transform>> open;
    const auto visit_later = [&](const std::vector<std::size_t>& nodes, const Transform& parent,
                                 const std::string& from) {
      for (std::size_t i = nodes.size(); i-- > 0;) {
        const std::size_t node = nodes[i];
        const std::string name = "node " + std::to_string(node);
        const Json& json = document_.at("nodes", node, from);
        if (worlds_[node]) document_.fail(name + " is reached twice: its nodes are no tree");
        worlds_[node] = parent * local_transform(document_, json, name);
        open.emplace_back(node, *worlds_[node]);
      }
    };
    visit_later(root_nodes(document_), Transform::Identity(), "its scene");
    while (!open.empty()) {
      const auto [index, world] = open.back();
      open.pop_back();
      in_order_.push_back(index);
      const std::string name = "node " + std::to_string(index);
      visit_later(document_.whole_list(document_.at("nodes", index, name), "children"), world,
                  name);
    }
  }

  /// The world transforms of all instances of a node's mesh; the joints place a skinned one.
  std::vector<Transform> world_places(std::size_t index) const {
    const Json& node = document_.root().at("nodes")[index];
    std::vector<Transform> places = instances(document_, node, "node " + std::to_string(index));
    for (Transform& place : places)
      place = node.contains("skin") ? Transform::Identity() : *worlds_[index] * place;
    return places;
  }

  void append_node(std::size_t index, const std::vector<Transform>& places,
                   PolygonMesh& out) const {
    const std::string name = "node " + std::to_string(index);
    const Json& node = document_.at("nodes", index, name);
    const std::size_t mesh_index = document_.whole(node, "mesh");
    const std::string mesh_name = "mesh " + std::to_string(mesh_index);
    const Json& gltf_mesh = document_.at("meshes", mesh_index, name);
    const Json& weighted = node.contains("weights") ? node : gltf_mesh;
    const std::vector<double> weights =
        reals(document_, weighted.value("weights", Json::array()), mesh_name);
    const bool skinned = node.contains("skin");
    std::vector<Transform> joints;
    if (skinned) joints = joints_of(document_.whole(node, "skin"), name);
    for (const Json& json : gltf_mesh.at("primitives")) {
      Primitive primitive = read_primitive(document_, json, mesh_name);
      if (primitive.triangles.empty()) continue;
      morph(document_, json, weights, mesh_name, primitive);
      if (skinned) pose(document_, json, joints, mesh_name, primitive);
      for (const Transform& place : places) append(document_, primitive, place, out);
    }
  }

  /// The transforms from the frame in which the skin was modelled to each joint's place.
  std::vector<Transform> joints_of(std::size_t index, const std::string& from) const {
    const std::string name = "skin " + std::to_string(index);
    const Json& skin = document_.at("skins", index, from);
    const std::vector<std::size_t> nodes = document_.whole_list(skin, "joints");
    std::vector<double> inverse;
    if (skin.contains("inverseBindMatrices"))
      inverse = document_.accessor(document_.whole(skin, "inverseBindMatrices"), "MAT4", name);
    if (skin.contains("inverseBindMatrices") && inverse.size() < 16 * nodes.size())
      document_.fail(name + ": fewer inverse bind matrices than joints");
    std::vector<Transform> joints;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      document_.at("nodes", nodes[i], name);
      if (!worlds_[nodes[i]])
        document_.fail(name + ": joint " + std::to_string(nodes[i]) + " stands in another scene");
      joints.push_back(*worlds_[nodes[i]]);
      if (!inverse.empty())
        joints.back() = joints.back() * affine(document_, &inverse[16 * i], name);
    }
    return joints;
  }

  void note_unread() {
    std::size_t left_out = 0;
    for (std::size_t i = 0; i < worlds_.size(); ++i)
      if (!worlds_[i] && document_.root().at("nodes")[i].contains("mesh")) ++left_out;
    if (left_out > 0)
      mesh_.notes.push_back(counted(left_out, "node") +
                            " with a mesh not read: outside of the default scene");
    for (const std::string& extension : document_.unread_extensions())
      mesh_.notes.push_back("the extension " + in_quotes(extension) +
                            " is not read: what it changes of the shape is missing");
  }

  const GltfDocument document_;
  std::vector<std::optional<Transform>> worlds_;  ///< of the nodes that the scene reaches
  std::vector<std::size_t> in_order_;
  PolygonMesh mesh_;
};

}  // namespace

/// Calls `read` for a scene; exceptions of the JSON library become an Error.
template <class Read>
static auto of_scene(const SourceFile& file, Read read) {
  try {
    return read(GltfScene(file));
  } catch (const nlohmann::json::exception& error) {
    std::string reason = error.what();
    for (char& c : reason)
      if (c < ' ' || c > '~') c = '?';
    fail(file, "is not valid glTF: " + reason);
  }
}

PolygonMesh read_gltf(const SourceFile& file) {
  return of_scene(file, [](GltfScene&& scene) { return scene.read(); });
}

GltfParts read_gltf_parts(const SourceFile& file) {
  return of_scene(file, [](GltfScene&& scene) { return scene.read_parts(); });
}

}  // namespace ist
