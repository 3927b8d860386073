#include "app/glb_scene.h"

#include <Eigen/Geometry>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>

#include "library/text.h"

namespace ist::app {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF is little-endian");

constexpr int kFloat = 5126, kUnsignedShort = 5123, kUnsignedInt = 5125, kVertices = 34962,
              kIndices = 34963;

/// A ball of radius 1: an icosahedron whose faces are cut in four, twice.
struct BallMesh {
  std::vector<std::array<float, 3>> vertices;  ///< normals too
  std::vector<std::array<std::uint16_t, 3>> triangles;
};

BallMesh make_ball() {
  const double g = (1 + std::sqrt(5.0)) / 2;
  std::vector<Eigen::Vector3d> at;
  for (const double a : {-1.0, 1.0})
    for (const double b : {-g, g})
      for (int k = 0; k < 3; ++k) {
        Eigen::Vector3d v = Eigen::Vector3d::Zero();
        v[k] = a;
        v[(k + 1) % 3] = b;
        at.push_back(v.normalized());
      }
  std::vector<std::array<std::uint16_t, 3>> faces;
  const auto beside = [&](std::size_t i, std::size_t j) {
    return (at[i] - at[j]).norm() < 1.01 * 2 / std::sqrt(1 + g * g);
  };
  for (std::uint16_t i = 0; i < 12; ++i)
    for (std::uint16_t j = 0; j < 12; ++j)
      for (std::uint16_t k = 0; k < 12; ++k)
        if (i < j && i < k && beside(i, j) && beside(j, k) && beside(k, i) &&
            at[i].dot(at[j].cross(at[k])) > 0)
          faces.push_back({i, j, k});
  for (int cut = 0; cut < 2; ++cut) {
    std::map<std::pair<std::uint16_t, std::uint16_t>, std::uint16_t> middles;
    const auto middle = [&](std::uint16_t a, std::uint16_t b) {
      const auto [found, added] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint16_t>(at.size()));
      if (added) at.push_back((at[a] + at[b]).normalized());
      return found->second;
    };
    std::vector<std::array<std::uint16_t, 3>> finer;
    for (const auto& [a, b, c] : faces) {
      const std::uint16_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      for (const auto& face : {std::array{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}})
        finer.push_back(face);
    }
    faces = std::move(finer);
  }
  BallMesh mesh;
  for (const Eigen::Vector3d& v : at)
    mesh.vertices.push_back(
        {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])});
  mesh.triangles = std::move(faces);
  return mesh;
}

void append(std::string& out, std::uint32_t number) {
  char bytes[sizeof(number)];
  std::memcpy(bytes, &number, sizeof(number));
  out.append(bytes, sizeof(number));
}

void append_chunk(std::string& out, const char (&type)[5], std::string chunk, char filler) {
  chunk.resize((chunk.size() + 3) / 4 * 4, filler);
  append(out, static_cast<std::uint32_t>(chunk.size()));
  out.append(type, 4);
  out += chunk;
}

}  // namespace

std::size_t GlbScene::add_material(const std::string& name, const std::array<double, 4>& colour) {
  materials_.push_back(
      {{"name", name},
       {"pbrMetallicRoughness",
        {{"baseColorFactor", colour}, {"metallicFactor", 0}, {"roughnessFactor", 0.7}}}});
  if (colour[3] < 1) materials_.back()["alphaMode"] = "BLEND";
  return materials_.size() - 1;
}

std::size_t GlbScene::add_view(const void* bytes, std::size_t count, int target) {
  data_.resize((data_.size() + 3) / 4 * 4, '\0');
  views_.push_back(
      {{"buffer", 0}, {"byteOffset", data_.size()}, {"byteLength", count}, {"target", target}});
  data_.append(static_cast<const char*>(bytes), count);
  return views_.size() - 1;
}

std::size_t GlbScene::add_vertices(std::span<const std::array<float, 3>> vertices) {
  std::array<float, 3> low = vertices[0], high = low;
  for (const auto& v : vertices)
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], v[k]);
      high[k] = std::max(high[k], v[k]);
    }
  accessors_.push_back({{"bufferView", add_view(vertices.data(), vertices.size_bytes(), kVertices)},
                        {"componentType", kFloat},
                        {"count", vertices.size()},
                        {"type", "VEC3"},
                        {"min", low},
                        {"max", high}});
  return accessors_.size() - 1;
}

std::size_t GlbScene::add_ball(const std::string& name, const std::array<double, 4>& colour) {
  if (ball_ == SIZE_MAX) {
    const BallMesh ball = make_ball();
    ball_ = add_vertices(ball.vertices);
    accessors_.push_back(
        {{"bufferView", add_view(ball.triangles.data(),
                                 ball.triangles.size() * sizeof(ball.triangles[0]), kIndices)},
         {"componentType", kUnsignedShort},
         {"count", 3 * ball.triangles.size()},
         {"type", "SCALAR"}});
  }
  meshes_.push_back({{"name", name},
                     {"primitives",
                      {{{"attributes", {{"POSITION", ball_}, {"NORMAL", ball_}}},
                        {"indices", ball_ + 1},
                        {"material", add_material(name, colour)}}}}});
  return meshes_.size() - 1;
}

std::size_t GlbScene::add_mesh(const std::string& name, const std::array<double, 4>& colour,
                               std::span<const Eigen::Vector3d> vertices,
                               std::span<const std::array<std::uint32_t, 3>> triangles) {
  std::vector<std::array<float, 3>> floats;
  for (const Eigen::Vector3d& v : vertices)
    floats.push_back(
        {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())});
  const std::size_t position = add_vertices(floats);
  accessors_.push_back(
      {{"bufferView", add_view(triangles.data(), triangles.size_bytes(), kIndices)},
       {"componentType", kUnsignedInt},
       {"count", 3 * triangles.size()},
       {"type", "SCALAR"}});
  meshes_.push_back({{"name", name},
                     {"primitives",
                      {{{"attributes", {{"POSITION", position}}},
                        {"indices", position + 1},
                        {"material", add_material(name, colour)}}}}});
  return meshes_.size() - 1;
}

std::size_t GlbScene::add_node(std::size_t parent, Json node) {
  children_[parent].push_back(nodes_.size());
  nodes_.push_back(std::move(node));
  children_.emplace_back();
  return nodes_.size() - 1;
}

void GlbScene::add_instance(std::size_t parent, std::size_t mesh, const Eigen::Vector3d& at,
                            double scale) {
  const auto f = [](double value) { return static_cast<float>(value); };
  add_node(parent, {{"mesh", mesh},
                    {"translation", {f(at.x()), f(at.y()), f(at.z())}},
                    {"scale", {f(scale), f(scale), f(scale)}}});
}

std::string GlbScene::bytes() const {
  Json nodes = nodes_;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (!children_[i].empty()) nodes[i]["children"] = children_[i];
  const Json json = {{"asset", {{"version", "2.0"}, {"generator", "ist"}}},
                     {"scene", 0},
                     {"scenes", {{{"nodes", {0}}}}},
                     {"nodes", nodes},
                     {"meshes", meshes_},
                     {"materials", materials_},
                     {"accessors", accessors_},
                     {"bufferViews", views_},
                     {"buffers", {{{"byteLength", data_.size()}}}}};
  std::string chunks;
  append_chunk(chunks, "JSON", json_text(json, -1), ' ');
  append_chunk(chunks, "BIN\0", data_, '\0');
  std::string out = "glTF";
  append(out, 2);
  append(out, static_cast<std::uint32_t>(12 + chunks.size()));
  return out + chunks;
}

}  // namespace ist::app
