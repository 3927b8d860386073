#include <gtest/gtest.h>

#include <random>
#include <string>

#include <ist/mesh.h>
#include <ist/types.h>

#include "support/damage.h"
#include "support/temp_file.h"

// Damaged files end in a mesh or in an Error, never in anything else. (Run under the sanitizers
// this looks for reads out of bounds too.)

namespace ist {
namespace {

using testing::TempFile;

void survive_damage(const std::string& name, const std::string& bytes) {
  ASSERT_NO_THROW(load_mesh(TempFile(name, bytes).path()));
  std::mt19937_64 random(1);
  for (int i = 0; i < 300; ++i) {
    const TempFile file(name, testing::damaged(bytes, random));
    try {
      close_mesh(load_mesh(file.path()), name, OpenMeshPolicy::repair);
    } catch (const Error&) {
    }
  }
}

const std::string kCornerText = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
const std::string kFaces = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";

TEST(DamagedFiles, Text) {
  survive_damage("a.off", "OFF\n4 4 6\n" + kCornerText + kFaces);
  survive_damage("a.ply",
                 "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                 "property float z\nelement face 4\nproperty list uchar int vertex_indices\n"
                 "end_header\n" +
                     kCornerText + kFaces);
  survive_damage(
      "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1/1 2/2 4/3\nf -3 -2 -1\nf 1 4 3\n");
  survive_damage("a.stl",
                 "solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                 "vertex 0 1 0\nendloop\nendfacet\nendsolid a\n");
}

TEST(DamagedFiles, Binary) {
  const auto raw = [](const auto value) {
    return std::string(reinterpret_cast<const char*>(&value), sizeof value);
  };
  constexpr float kPoints[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  constexpr std::int32_t kCorner[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  std::string ply =
      "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\n"
      "property float y\nproperty float z\nelement face 4\n"
      "property list uchar int vertex_indices\nend_header\n";
  std::string stl(80, ' ');
  stl += raw(std::uint32_t{4});
  for (const auto& p : kPoints)
    for (const float x : p) ply += raw(x);
  for (const auto& f : kCorner) {
    ply += '\3';
    stl.append(12, '\0');
    for (const std::int32_t v : f) {
      ply += raw(v);
      for (const float x : kPoints[v]) stl += raw(x);
    }
    stl.append(2, '\0');
  }
  survive_damage("a.ply", ply);
  survive_damage("a.stl", stl);
}

TEST(DamagedFiles, Gltf) {
  survive_damage(
      "a.gltf",
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,
      "scale":[1,2,1]}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
      "buffers":[{"byteLength":72,"uri":"data:application/octet-stream;base64,)"
      "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/"
      "AAACAAEAAAABAAMAAQACAAMAAAADAAIA"
      R"("}],"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24}],
      "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
      {"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}]})");
}

}  // namespace
}  // namespace ist
