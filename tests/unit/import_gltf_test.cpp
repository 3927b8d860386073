#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include <ist/mesh.h>
#include <ist/types.h>

#include "support/temp_file.h"

namespace ist {
namespace {

using nlohmann::json;
using testing::TempFile;

template <class T>
std::string raw(const std::initializer_list<T> values) {
  std::string bytes;
  for (const T value : values) bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  return bytes;
}

/// A tetrahedron of volume 1/6: 48 bytes of positions, 24 of indices.
std::string tetrahedron_buffer() {
  return raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}) +
         raw<std::uint16_t>({0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2});
}

json tetrahedron() {
  return json::parse(R"({
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "buffers": [{"byteLength": 72}],
    "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                  {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"}]})");
}

std::string glb(const json& document, const std::string& buffer = tetrahedron_buffer()) {
  std::string text = document.dump();
  while (text.size() % 4 != 0) text += ' ';
  const auto word = [](std::size_t value) { return raw({static_cast<std::uint32_t>(value)}); };
  return "glTF" + word(2) + word(12 + 8 + text.size() + 8 + buffer.size()) + word(text.size()) +
         "JSON" + text + word(buffer.size()) + std::string("BIN\0", 4) + buffer;
}

double volume_of(const std::string& bytes) {
  return close_mesh(load_mesh(TempFile("a.glb", bytes).path()), "a").report.volume;
}

std::string error_of(const json& document) {
  try {
    load_mesh(TempFile("a.glb", glb(document)).path());
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ReadGltf, ContainerDataUriAndFileBeside) {
  EXPECT_NEAR(volume_of(glb(tetrahedron())), 1.0 / 6, 1e-15);
  json document = tetrahedron();
  document["buffers"][0]["uri"] = "some%20data.bin";
  const TempFile file("a.gltf", document.dump());
  file.add("some data.bin", tetrahedron_buffer());
  EXPECT_EQ(load_mesh(file.path()).triangles.size(), 4u);
  document["buffers"][0]["uri"] =
      "data:application/octet-stream;base64,"
      "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/"
      "AAACAAEAAAABAAMAAQACAAMAAAADAAIA";
  EXPECT_EQ(load_mesh(TempFile("a.gltf", document.dump()).path()).triangles.size(), 4u);
}

TEST(ReadGltf, NodesPlaceMeshesInDouble) {
  json document = tetrahedron();
  document["nodes"] = json::parse(R"([
    {"children": [1, 2], "scale": [2, 2, 2], "translation": [10, 0, 0]},
    {"mesh": 0, "rotation": [0, 0, 0.70710678118654752, 0.70710678118654752]},
    {"mesh": 0, "matrix": [1,0,0,0, 0,1,0,0, 0,0,-1,0, 5,0,0,1]}])");
  const TriangleMesh mesh = load_mesh(TempFile("a.glb", glb(document)).path());
  ASSERT_EQ(mesh.vertices.size(), 8u);
  EXPECT_NEAR((mesh.vertices[1] - Eigen::Vector3d(10, 2, 0)).norm(), 0, 1e-14);  // x → y, doubled
  EXPECT_NEAR((mesh.vertices[7] - Eigen::Vector3d(20, 0, -2)).norm(), 0, 1e-14);  // mirrored in z
  const ClosedMesh closed = close_mesh(mesh, "a");
  EXPECT_NEAR(closed.report.volume, 2 * 8.0 / 6, 1e-13);
  EXPECT_EQ(closed.report.flipped_components, 0u);  // the import turned the mirror's faces
}

TEST(ReadGltf, StripsAndFansWindAsTheyShould) {
  // One tetrahedron as a strip: 0 2 1 3 0 2 → four faces of alternating sense.
  json strip = tetrahedron();
  strip["meshes"][0]["primitives"][0]["mode"] = 5;
  strip["accessors"][1]["count"] = 6;
  const std::string positions = tetrahedron_buffer().substr(0, 48);
  const std::string indices = raw<std::uint16_t>({0, 2, 1, 3, 0, 2});
  EXPECT_NEAR(volume_of(glb(strip, positions + indices + std::string(12, '\0'))), 1.0 / 6, 1e-15);
  // A fan of three faces about corner 3, and the base as triangles.
  json fan = tetrahedron();
  fan["meshes"][0]["primitives"][0]["mode"] = 6;
  fan["accessors"][1]["count"] = 5;
  fan["accessors"].push_back(fan["accessors"][1]);
  fan["accessors"][2]["count"] = 3;
  fan["accessors"][2]["byteOffset"] = 10;
  fan["meshes"][0]["primitives"].push_back(tetrahedron()["meshes"][0]["primitives"][0]);
  fan["meshes"][0]["primitives"][1]["indices"] = 2;
  const std::string both = raw<std::uint16_t>({3, 0, 1, 2, 0, 0, 2, 1});
  const TriangleMesh mesh =
      load_mesh(TempFile("a.glb", glb(fan, positions + both + std::string(8, '\0'))).path());
  const ClosedMesh closed = close_mesh(mesh, "a");
  EXPECT_NEAR(closed.report.volume, 1.0 / 6, 1e-15);
  EXPECT_EQ(closed.report.inconsistent_edges, 0u);
}

TEST(ReadGltf, NormalizedAndStridedAccessors) {
  json document = tetrahedron();
  document["extensionsRequired"] = {"KHR_mesh_quantization"};
  document["accessors"][0] = {{"bufferView", 0},
                              {"componentType", 5120},
                              {"count", 4},
                              {"type", "VEC3"},
                              {"normalized", true}};
  document["bufferViews"][0]["byteStride"] = 4;
  std::string buffer = raw<std::int8_t>({0, 0, 0, 9, 127, 0, 0, 9, 0, 127, 0, 9, 0, 0, 127, 9});
  buffer.resize(48);
  EXPECT_NEAR(volume_of(glb(document, buffer + tetrahedron_buffer().substr(48))), 1.0 / 6, 1e-15);
}

json with_more(json document, std::string& buffer, const std::string& bytes,
               const std::string& type, const int component, const std::size_t count) {
  const std::size_t view = document["bufferViews"].size();
  document["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", bytes.size()}});
  document["accessors"].push_back(
      {{"bufferView", view}, {"componentType", component}, {"count", count}, {"type", type}});
  buffer += bytes;
  while (buffer.size() % 4 != 0) buffer += '\0';
  document["buffers"][0]["byteLength"] = buffer.size();
  return document;
}

TEST(ReadGltf, JointsPlaceASkin) {
  // Joint 1 doubles and moves, joint 2 mirrors; the node's own translation does not count.
  std::string buffer = tetrahedron_buffer();
  json document = with_more(tetrahedron(), buffer, std::string(16, '\1'), "VEC4", 5121, 4);
  const std::string all_one = raw<float>({0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0, 2});
  document = with_more(document, buffer, all_one, "VEC4", 5126, 4);
  document["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = 2;
  document["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = 3;
  document["nodes"] = json::parse(R"([
    {"mesh": 0, "skin": 0, "translation": [100, 0, 0]},
    {"scale": [2, 2, 2], "translation": [10, 0, 0], "children": [2]},
    {"scale": [-1, 1, 1]}])");
  document["scenes"][0]["nodes"] = {0, 1};
  document["skins"] = {{{"joints", {2, 1}}}};
  const TriangleMesh doubled = load_mesh(TempFile("a.glb", glb(document, buffer)).path());
  EXPECT_EQ(doubled.vertices[1], Eigen::Vector3d(12, 0, 0));
  EXPECT_TRUE(doubled.notes.empty());
  document["skins"][0]["joints"] = {1, 2};
  const TriangleMesh mirrored = load_mesh(TempFile("a.glb", glb(document, buffer)).path());
  EXPECT_EQ(mirrored.vertices[1], Eigen::Vector3d(8, 0, 0));
  const ClosedMesh closed = close_mesh(mirrored, "a");
  EXPECT_NEAR(closed.report.volume, 8.0 / 6, 1e-14);
  EXPECT_EQ(closed.report.flipped_components, 0u);
  // The inverse bind matrix comes first.
  document =
      with_more(document, buffer, raw<float>({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0,  0, 0, 1,  //
                                              1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1}),
                "MAT4", 5126, 2);
  document["skins"][0]["inverseBindMatrices"] = 4;
  EXPECT_EQ(load_mesh(TempFile("a.glb", glb(document, buffer)).path()).vertices[1],
            Eigen::Vector3d(10, 0, 0));
  document["skins"][0]["joints"] = {1};
  document["skins"][0].erase("inverseBindMatrices");
  EXPECT_NE(error_of(document).find("ends early"), std::string::npos);
  try {
    load_mesh(TempFile("a.glb", glb(document, buffer)).path());
    ADD_FAILURE() << "a joint that is not there";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("joint 1 of 1"), std::string::npos) << error.what();
  }
}

TEST(ReadGltf, WeightsMorphAndNodesComeBeforeMeshes) {
  std::string buffer = tetrahedron_buffer();
  json document = with_more(tetrahedron(), buffer, raw<float>({0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0}),
                            "VEC3", 5126, 4);
  // A sparse target: vertex 3 moves up by 1.
  document = with_more(document, buffer, raw<std::uint16_t>({3}), "SCALAR", 5123, 1);
  document = with_more(document, buffer, raw<float>({0, 0, 1}), "VEC3", 5126, 1);
  document["accessors"].push_back({{"componentType", 5126},
                                   {"count", 4},
                                   {"type", "VEC3"},
                                   {"sparse",
                                    {{"count", 1},
                                     {"indices", {{"bufferView", 3}, {"componentType", 5123}}},
                                     {"values", {{"bufferView", 4}}}}}});
  document["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", 2}}, {{"POSITION", 5}}};
  EXPECT_NEAR(volume_of(glb(document, buffer)), 1.0 / 6, 1e-15);
  document["meshes"][0]["weights"] = {1, 0};
  EXPECT_NEAR(volume_of(glb(document, buffer)), 4.0 / 6, 1e-14);
  document["nodes"][0]["weights"] = {0, 1};
  EXPECT_NEAR(volume_of(glb(document, buffer)), 2.0 / 6, 1e-14);
  document["nodes"][0]["weights"] = {1};
  EXPECT_THROW(volume_of(glb(document, buffer)), Error);
  document["nodes"][0]["weights"] = {0, 1};
  document["accessors"][5]["sparse"]["count"] = 2;
  EXPECT_THROW(volume_of(glb(document, buffer)), Error);
}

TEST(ReadGltf, InstancesAreCopiesAndOtherExtensionsAreNamed) {
  std::string buffer = tetrahedron_buffer();
  json document =
      with_more(tetrahedron(), buffer, raw<float>({5, 0, 0, 0, 7, 0, 0, 0, 9}), "VEC3", 5126, 3);
  document["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = 2;
  document["nodes"][0]["scale"] = {-1, 1, 1};
  document["extensionsUsed"] = {"EXT_mesh_gpu_instancing", "KHR_materials_unlit", "X_bent"};
  document["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
  document["nodes"].push_back({{"mesh", 0}});
  const TriangleMesh mesh = load_mesh(TempFile("a.glb", glb(document, buffer)).path());
  ASSERT_EQ(mesh.vertices.size(), 12u);
  EXPECT_EQ(mesh.vertices[0], Eigen::Vector3d(-5, 0, 0));
  ASSERT_EQ(mesh.notes.size(), 2u);
  EXPECT_NE(mesh.notes[0].find("1 node with a mesh not read"), std::string::npos);
  EXPECT_NE(mesh.notes[1].find("X_bent"), std::string::npos);
  const ClosedMesh closed = close_mesh(mesh, "a");
  EXPECT_NEAR(closed.report.volume, 0.5, 1e-14);
  EXPECT_EQ(std::vector(closed.report.notes.begin(), closed.report.notes.begin() + 2), mesh.notes);
}

TEST(ReadGltf, EveryLieIsCaught) {
  struct Lie {
    std::string words;
    std::function<void(json&)> tell;
  };
  const std::vector<Lie> lies = {
      {"version", [](json& d) { d["asset"]["version"] = "1.0"; }},
      {"KHR_draco", [](json& d) { d["extensionsRequired"] = {"KHR_draco_mesh_compression"}; }},
      {"do not fit", [](json& d) { d["accessors"][0]["count"] = 5; }},
      {"do not fit", [](json& d) { d["accessors"][0]["count"] = 1ull << 62; }},
      {"do not fit", [](json& d) { d["accessors"][0]["byteOffset"] = 4; }},
      {"do not fit", [](json& d) { d["accessors"][0]["count"] = 0; }},
      {"whole number", [](json& d) { d["accessors"][0]["count"] = -4; }},
      {"componentType", [](json& d) { d["accessors"][0]["componentType"] = 5130; }},
      {"not \"VEC3\"", [](json& d) { d["accessors"][0]["type"] = "VEC2"; }},
      {"outside of buffer", [](json& d) { d["bufferViews"][0]["byteOffset"] = 4294967292u; }},
      {"outside of buffer", [](json& d) { d["bufferViews"][1]["byteLength"] = 25; }},
      {"byteStride", [](json& d) { d["bufferViews"][0]["byteStride"] = 8; }},
      {"byteStride", [](json& d) { d["bufferViews"][0]["byteStride"] = 13; }},
      {"ends early", [](json& d) { d["buffers"][0]["byteLength"] = 73; }},
      {"outside its own folder", [](json& d) { d["buffers"][0]["uri"] = "../a.bin"; }},
      {"outside its own folder", [](json& d) { d["buffers"][0]["uri"] = "%2e%2e/a.bin"; }},
      {"outside its own folder", [](json& d) { d["buffers"][0]["uri"] = "/etc/passwd"; }},
      {"outside its own folder", [](json& d) { d["buffers"][0]["uri"] = "file:///etc/passwd"; }},
      {"no such file", [](json& d) { d["buffers"][0]["uri"] = "missing.bin"; }},
      {"base64", [](json& d) { d["buffers"][0]["uri"] = "data:;base64,###"; }},
      {"reached twice", [](json& d) { d["nodes"][0]["children"] = {0}; }},
      {"reached twice",
       [](json& d) {
         d["nodes"] = {{{"children", {1, 1}}}, {{"mesh", 0}}};
       }},
      {"\"children\"", [](json& d) { d["nodes"][0]["children"] = {-1}; }},
      {"\"children\"", [](json& d) { d["nodes"][0]["children"] = {1e300}; }},
      {"\"meshes\"", [](json& d) { d["nodes"][0]["mesh"] = 1; }},
      {"whole number", [](json& d) { d["nodes"][0]["mesh"] = "0"; }},
      {"float32",
       [](json& d) {
         d["nodes"][0]["scale"] = {1e39, 1, 1};
       }},
      {"numbers",
       [](json& d) {
         d["nodes"][0]["scale"] = {1, 1};
       }},
      {"rotation is zero",
       [](json& d) {
         d["nodes"][0]["rotation"] = {0, 0, 0, 0};
       }},
      {"projection",
       [](json& d) { d["nodes"][0]["matrix"] = {1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; }},
      {"not a multiple of three", [](json& d) { d["accessors"][1]["count"] = 11; }},
      {"names vertex 3 of 3", [](json& d) { d["accessors"][0]["count"] = 3; }},
      {"\"count\"", [](json& d) { d["accessors"][0]["sparse"] = json::object(); }},
      {"without data",
       [](json& d) {
         d["accessors"][0].erase("bufferView");
         d["accessors"][0]["count"] = 1 << 20;
       }},
      {"mode", [](json& d) { d["meshes"][0]["primitives"][0]["mode"] = 7; }},
      {"not valid glTF", [](json& d) { d.erase("asset"); }},
      {"not valid glTF", [](json& d) { d["meshes"][0].erase("primitives"); }},
      {"no faces", [](json& d) { d["meshes"][0]["primitives"][0]["mode"] = 1; }},
      {"no faces", [](json& d) { d["scenes"][0] = json::object(); }},
  };
  for (const Lie& lie : lies) {
    json document = tetrahedron();
    lie.tell(document);
    EXPECT_NE(error_of(document).find(lie.words), std::string::npos)
        << lie.words << ": " << error_of(document) << "\n"
        << document;
  }
}

TEST(ReadGltf, AContainerOfAnyAnnouncedLengthIsReadOrRefused) {
  const std::string whole = glb(tetrahedron());
  for (std::uint32_t length = 0; length < whole.size() + 20; ++length) {
    std::string bytes = whole;
    std::memcpy(bytes.data() + 8, &length, sizeof(length));
    try {
      load_mesh(TempFile("a.glb", bytes).path());
      EXPECT_EQ(length, whole.size());
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("a.glb: "), std::string::npos) << length;
    }
  }
}

TEST(ReadGltf, DeepAndWideScenesEnd) {
  json deep = tetrahedron();
  deep["nodes"] = json::array();
  for (int i = 0; i < 20000; ++i) deep["nodes"].push_back({{"children", {i + 1}}});
  deep["nodes"].push_back({{"mesh", 0}});
  EXPECT_NEAR(volume_of(glb(deep)), 1.0 / 6, 1e-15);
  // 200 kB that request 10^12 triangles.
  json wide = tetrahedron();
  wide["nodes"] = json::array();
  wide["meshes"][0]["primitives"] = json(2000, wide["meshes"][0]["primitives"][0]);
  for (int i = 0; i < 2000; ++i) wide["nodes"].push_back({{"mesh", 0}});
  wide["scenes"][0]["nodes"] = json::array();
  for (int i = 0; i < 2000; ++i) wide["scenes"][0]["nodes"].push_back(i);
  EXPECT_NE(error_of(wide).find("Flatten"), std::string::npos);
}

}  // namespace
}  // namespace ist
