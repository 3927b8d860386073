#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "mesh/import/gltf_document.h"
#include "mesh/import/polygon_mesh.h"
#include "mesh/message_text.h"

namespace ist {
namespace {

using Json = GltfDocument::Json;
using Transform = Eigen::Affine3d;

Transform local_transform(const GltfDocument& document, const Json& node, const std::string& name) {
  const auto numbers = [&](const char* key, const std::vector<double>& fallback) {
    if (!node.contains(key)) return fallback;
    std::vector<double> values;
    for (const Json& value : node.at(key)) values.push_back(document.real(value, name));
    if (values.size() != fallback.size())
      document.fail(name + ": its " + key + " has " + std::to_string(values.size()) + " numbers");
    return values;
  };
  Transform transform = Transform::Identity();
  if (node.contains("matrix")) {
    const std::vector<double> m = numbers("matrix", std::vector<double>(16));  // by columns
    if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)
      document.fail(name + ": its matrix is a projection, not a transform");
    transform.matrix() = Eigen::Map<const Eigen::Matrix4d>(m.data());
    return transform;
  }
  const std::vector<double> t = numbers("translation", {0, 0, 0});
  const std::vector<double> r = numbers("rotation", {0, 0, 0, 1});  // x y z w
  const std::vector<double> s = numbers("scale", {1, 1, 1});
  const Eigen::Quaterniond rotation(r[3], r[0], r[1], r[2]);
  if (!(rotation.norm() > 0)) document.fail(name + ": its rotation is zero");
  transform.translate(Eigen::Vector3d(t[0], t[1], t[2]));
  transform.rotate(rotation.normalized());
  transform.scale(Eigen::Vector3d(s[0], s[1], s[2]));
  return transform;
}

std::vector<std::uint32_t> corner_indices(const GltfDocument& document, const Json& primitive,
                                          const std::size_t vertex_count, const std::string& name) {
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

void append_primitive(const GltfDocument& document, const Json& primitive, const Transform& world,
                      const std::size_t most_corners, const std::string& name, PolygonMesh& out) {
  enum : std::size_t { kTriangles = 4, kStrip = 5, kFan = 6 };
  const std::size_t mode = document.whole(primitive, "mode", kTriangles);
  if (mode > kFan) document.fail(name + ": unknown primitive mode " + std::to_string(mode));
  if (mode < kTriangles || !primitive.at("attributes").contains("POSITION")) return;  // no surface
  const std::vector<double> positions =
      document.accessor(document.whole(primitive.at("attributes"), "POSITION"), "VEC3", name);
  const std::size_t vertex_count = positions.size() / 3;
  const std::vector<std::uint32_t> indices =
      corner_indices(document, primitive, vertex_count, name);
  const auto first = static_cast<std::uint32_t>(out.vertices.size());
  if (out.corners.size() + 3 * indices.size() > most_corners ||
      out.vertices.size() + vertex_count > std::min<std::size_t>(most_corners, UINT32_MAX))
    document.fail("its nodes repeat its meshes to more than " + std::to_string(most_corners) +
                  " corners. Flatten or split the scene");
  for (std::size_t i = 0; i < vertex_count; ++i)
    out.vertices.push_back(world * Eigen::Vector3d(&positions[3 * i]));

  // A mirror turns every face inside out; turn it back.
  const bool mirrored = world.linear().determinant() < 0;
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (mirrored) std::swap(b, c);
    out.add_triangle(first + a, first + b, first + c);
  };
  if (mode == kTriangles && indices.size() % 3 != 0)
    document.fail(name + ": " + std::to_string(indices.size()) +
                  " corners are not a multiple of three");
  if (mode == kTriangles)
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3)
      add(indices[i], indices[i + 1], indices[i + 2]);
  for (std::size_t i = 0; mode == kStrip && i + 2 < indices.size(); ++i)
    add(indices[i], indices[i + 1 + i % 2], indices[i + 2 - i % 2]);
  for (std::size_t i = 1; mode == kFan && i + 1 < indices.size(); ++i)
    add(indices[0], indices[i], indices[i + 1]);
}

std::vector<std::size_t> root_nodes(const GltfDocument& document) {
  std::vector<std::size_t> roots;
  const Json& root = document.root();
  if (root.contains("scenes")) {
    const Json& scene = document.at("scenes", document.whole(root, "scene", 0), "the file");
    return document.whole_list(scene, "nodes");
  }
  // Without a scene: every node that is no child.
  const Json nodes = root.value("nodes", Json::array());
  std::vector<bool> is_child(nodes.size(), false);
  for (const Json& node : nodes)
    for (const std::size_t child : document.whole_list(node, "children"))
      if (child < is_child.size()) is_child[child] = true;
  for (std::size_t i = 0; i < is_child.size(); ++i)
    if (!is_child[i]) roots.push_back(i);
  return roots;
}

PolygonMesh read_scene(const SourceFile& file) {
  const GltfDocument document(file);
  // A small file can ask for many copies of its meshes: more than this is no accident.
  const std::size_t most_corners = 12'000'000 + file.bytes.size();
  PolygonMesh mesh;
  mesh.declared = {.up_axis = 'Y', .unit = 1};  // every glTF file, by its specification
  std::vector<bool> seen(document.root().value("nodes", Json::array()).size(), false);
  std::vector<std::pair<std::size_t, Transform>> open;
  const auto visit_later = [&](const std::vector<std::size_t>& nodes, const Transform& parent,
                               const std::string& from) {
    for (std::size_t i = nodes.size(); i-- > 0;) {
      const std::size_t node = nodes[i];
      const std::string name = "node " + std::to_string(node);
      const Json& json = document.at("nodes", node, from);
      if (seen[node]) document.fail(name + " is reached twice: its nodes are no tree");
      seen[node] = true;
      open.emplace_back(node, parent * local_transform(document, json, name));
    }
  };
  visit_later(root_nodes(document), Transform::Identity(), "its scene");
  while (!open.empty()) {
    const auto [index, world] = open.back();
    open.pop_back();
    const std::string name = "node " + std::to_string(index);
    const Json& node = document.at("nodes", index, name);
    if (node.contains("mesh")) {
      // The joints place a skinned mesh, not its node: in the bind pose, where it was modelled.
      const Transform placed = node.contains("skin") ? Transform::Identity() : world;
      const std::size_t mesh_index = document.whole(node, "mesh");
      const Json& gltf_mesh = document.at("meshes", mesh_index, name);
      for (const Json& primitive : gltf_mesh.at("primitives"))
        append_primitive(document, primitive, placed, most_corners,
                         "mesh " + std::to_string(mesh_index), mesh);
    }
    visit_later(document.whole_list(node, "children"), world, name);
  }
  return mesh;
}

}  // namespace

PolygonMesh read_gltf(const SourceFile& file) {
  try {
    return read_scene(file);
  } catch (const nlohmann::json::exception& error) {
    std::string reason = error.what();
    for (char& c : reason)
      if (c < ' ' || c > '~') c = '?';
    fail(file, "is not valid glTF: " + reason);
  }
}

}  // namespace ist
