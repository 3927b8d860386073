#include "app/tree_glb.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include <ist/asset_layout.h>
#include <ist/error.h>

namespace ist::app {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF is little-endian");

using Json = nlohmann::ordered_json;

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

/// Colours of the spheres, their groups, the groups' groups …; all but the spheres let light
/// through.
Json material_of(std::size_t level) {
  constexpr std::array<std::array<double, 3>, 5> kColours = {{{0.90, 0.62, 0.28},
                                                              {0.25, 0.55, 0.85},
                                                              {0.35, 0.70, 0.40},
                                                              {0.75, 0.40, 0.65},
                                                              {0.55, 0.55, 0.60}}};
  const auto& c = kColours[level % kColours.size()];
  Json material = {{"name", level == 0 ? "spheres" : fmt::format("level {}", level)},
                   {"pbrMetallicRoughness",
                    {{"baseColorFactor", {c[0], c[1], c[2], level == 0 ? 1.0 : 0.2}},
                     {"metallicFactor", 0},
                     {"roughnessFactor", 0.7}}}};
  if (level > 0) material["alphaMode"] = "BLEND";
  return material;
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

std::string tree_glb(const TreeView& view, Measure measure, std::uint32_t detail,
                     const std::string& name) {
  const AssetHeader& header = view.header();
  const TreeHeader& tree =
      measure == Measure::inner ? header.inner_tree : matched_tree(header, detail);
  const double scale = std::ldexp(1.0, header.exponent);
  constexpr int kMostExponent = 100;  // of what floats can hold, and viewers square
  if (std::abs(header.exponent) > kMostExponent)
    throw Error(name + ": its size of about 2^" + std::to_string(header.exponent) +
                " u is out of range for a .glb (2^-100 to 2^100); export .csv, .ply or .json");
  Json nodes = Json::array(), meshes = Json::array(), materials = Json::array();
  nodes.push_back({{"name", name},
                   {"translation", {header.centre[0], header.centre[1], header.centre[2]}},
                   {"children", Json::array()}});
  for (std::uint32_t level = 0; level < tree.level_count; ++level) {
    const std::size_t group = nodes.size();
    nodes[0]["children"].push_back(group);
    materials.push_back(material_of(level));
    meshes.push_back({{"name", materials.back()["name"]},
                      {"primitives",
                       {{{"attributes", {{"POSITION", 0}, {"NORMAL", 0}}},
                         {"indices", 1},
                         {"material", level}}}}});
    Json children = Json::array();
    nodes.push_back({{"name", materials.back()["name"]}});
    const BallBlock* const blocks = at<BallBlock>(header, tree.level[level].blocks);
    const Origin* const origins = at<Origin>(header, tree.level[level].origins);
    for (std::uint32_t b = 0; b < tree.level[level].count; ++b)
      for (std::uint32_t lane = 0; lane < kWidth; ++lane) {
        const double r = static_cast<double>(blocks[b].r[lane]) * scale;
        if (!(r > 0)) continue;
        const double x[3] = {origins[b].x + static_cast<double>(blocks[b].x[lane]),
                             origins[b].y + static_cast<double>(blocks[b].y[lane]),
                             origins[b].z + static_cast<double>(blocks[b].z[lane])};
        children.push_back(nodes.size());
        const auto f = [&](double value) { return static_cast<float>(value); };
        nodes.push_back({{"mesh", level},
                         {"translation", {f(x[0] * scale), f(x[1] * scale), f(x[2] * scale)}},
                         {"scale", {f(r), f(r), f(r)}}});
      }
    nodes[group]["children"] = std::move(children);
  }

  const BallMesh ball = make_ball();
  const std::size_t vertex_bytes = ball.vertices.size() * sizeof(ball.vertices[0]);
  const std::size_t index_bytes = ball.triangles.size() * sizeof(ball.triangles[0]);
  std::string data(vertex_bytes + index_bytes, '\0');
  std::memcpy(data.data(), ball.vertices.data(), vertex_bytes);
  std::memcpy(data.data() + vertex_bytes, ball.triangles.data(), index_bytes);
  std::array<float, 3> low = ball.vertices[0], high = low;
  for (const auto& v : ball.vertices)
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], v[k]);
      high[k] = std::max(high[k], v[k]);
    }
  constexpr int kFloat = 5126, kUnsignedShort = 5123, kVertices = 34962, kIndices = 34963;
  const Json json = {
      {"asset", {{"version", "2.0"}, {"generator", "ist"}}},
      {"scene", 0},
      {"scenes", {{{"nodes", {0}}}}},
      {"nodes", nodes},
      {"meshes", meshes},
      {"materials", materials},
      {"accessors",
       {{{"bufferView", 0},
         {"componentType", kFloat},
         {"count", ball.vertices.size()},
         {"type", "VEC3"},
         {"min", low},
         {"max", high}},
        {{"bufferView", 1},
         {"componentType", kUnsignedShort},
         {"count", 3 * ball.triangles.size()},
         {"type", "SCALAR"}}}},
      {"bufferViews",
       {{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", vertex_bytes}, {"target", kVertices}},
        {{"buffer", 0},
         {"byteOffset", vertex_bytes},
         {"byteLength", index_bytes},
         {"target", kIndices}}}},
      {"buffers", {{{"byteLength", data.size()}}}}};
  std::string chunks;
  append_chunk(chunks, "JSON", json.dump(), ' ');
  append_chunk(chunks, "BIN\0", data, '\0');
  std::string out = "glTF";
  append(out, 2);
  append(out, static_cast<std::uint32_t>(12 + chunks.size()));
  return out + chunks;
}

}  // namespace ist::app
