#include "app/glb_scene.h"

#include <bit>
#include <cstring>
#include <utility>

#include "library/text.h"
#include "mesh/samples/samples.h"

namespace ist::app {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF is little-endian");

constexpr int kFloat = 5126, kUnsignedShort = 5123, kUnsignedInt = 5125, kVertices = 34962,
              kIndices = 34963;

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

template <class Index>
std::size_t GlbScene::add_triangles(std::span<const Eigen::Vector3d> vertices,
                                    std::span<const std::array<Index, 3>> triangles) {
  std::vector<std::array<float, 3>> at;
  for (const Eigen::Vector3d& v : vertices)
    at.push_back({static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())});
  std::array<float, 3> low = at[0], high = low;
  for (const auto& v : at)
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], v[k]);
      high[k] = std::max(high[k], v[k]);
    }
  accessors_.push_back({{"bufferView", add_view(at.data(), std::span(at).size_bytes(), kVertices)},
                        {"componentType", kFloat},
                        {"count", at.size()},
                        {"type", "VEC3"},
                        {"min", low},
                        {"max", high}});
  accessors_.push_back(
      {{"bufferView", add_view(triangles.data(), triangles.size_bytes(), kIndices)},
       {"componentType", sizeof(Index) == 2 ? kUnsignedShort : kUnsignedInt},
       {"count", 3 * triangles.size()},
       {"type", "SCALAR"}});
  return accessors_.size() - 2;
}

std::size_t GlbScene::add_mesh(const std::string& name, const std::array<double, 4>& colour,
                               const Json& attributes, std::size_t indices) {
  meshes_.push_back({{"name", name},
                     {"primitives",
                      {{{"attributes", attributes},
                        {"indices", indices},
                        {"material", add_material(name, colour)}}}}});
  return meshes_.size() - 1;
}

std::size_t GlbScene::add_ball(const std::string& name, const std::array<double, 4>& colour) {
  if (ball_ == SIZE_MAX) {
    const TriangleMesh ball = shapes::sphere(1, 2);
    std::vector<std::array<std::uint16_t, 3>> triangles;
    for (const auto& [a, b, c] : ball.triangles)
      triangles.push_back({static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(b),
                           static_cast<std::uint16_t>(c)});
    ball_ = add_triangles<std::uint16_t>(ball.vertices, triangles);
  }
  return add_mesh(name, colour, Json::object({{"POSITION", ball_}, {"NORMAL", ball_}}), ball_ + 1);
}

std::size_t GlbScene::add_mesh(const std::string& name, const std::array<double, 4>& colour,
                               std::span<const Eigen::Vector3d> vertices,
                               std::span<const std::array<std::uint32_t, 3>> triangles) {
  const std::size_t position = add_triangles<std::uint32_t>(vertices, triangles);
  return add_mesh(name, colour, Json::object({{"POSITION", position}}), position + 1);
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
