#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include <ist/mesh.h>

#include "support/temp_file.h"

// No reader rotates a file's axes, whatever the library below does: a tetrahedron of 1 × 2 × 3 with
// its right angle at the origin is read as written in every format.

namespace ist {
namespace {

TriangleMesh load(const std::string& name, const std::string& bytes) {
  return load_mesh(testing::TempFile(name, bytes).path());
}

void expect_own_axes(const TriangleMesh& mesh) {
  const ClosedMesh closed = close_mesh(mesh, "tetrahedron");
  EXPECT_EQ(closed.report.bounds.min(), Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(closed.report.bounds.max(), Eigen::Vector3d(1, 2, 3));
  EXPECT_NEAR(closed.report.volume, 1, 1e-15);
  EXPECT_EQ(closed.report.flipped_components, 0u);
}

constexpr int kCorners[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
constexpr float kVertices[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};

template <class T>
std::string bytes_of(T value) {
  return std::string(reinterpret_cast<const char*>(&value), sizeof(value));
}

std::string chunk(std::uint16_t id, const std::string& body) {
  return bytes_of(id) + bytes_of(static_cast<std::uint32_t>(body.size() + 6)) + body;
}

std::string tetrahedron_3ds() {
  std::string vertices = bytes_of(std::uint16_t{4}), faces = bytes_of(std::uint16_t{4});
  for (const auto& vertex : kVertices)
    for (const float x : vertex) vertices += bytes_of(x);
  for (const auto& triangle : kCorners) {
    for (const int corner : triangle) faces += bytes_of(static_cast<std::uint16_t>(corner));
    faces += bytes_of(std::uint16_t{0});  // flags
  }
  const std::string mesh = chunk(0x4100, chunk(0x4110, vertices) + chunk(0x4120, faces));
  return chunk(0x4d4d, chunk(0x3d3d, chunk(0x4000, std::string("a") + '\0' + mesh)));
}

std::string tetrahedron_dxf() {
  std::string text = "0\nSECTION\n2\nENTITIES\n";
  for (const auto& triangle : kCorners) {
    text += "0\n3DFACE\n8\na\n";
    for (int k = 0; k < 4; ++k)
      for (int axis = 0; axis < 3; ++axis)
        text += std::to_string(10 * (axis + 1) + k) + "\n" +
                std::to_string(kVertices[triangle[k < 3 ? k : 2]][axis]) + "\n";
  }
  return text + "0\nENDSEC\n0\nEOF\n";
}

std::string tetrahedron_ase() {
  std::string text =
      "*3DSMAX_ASCIIEXPORT 200\n*GEOMOBJECT {\n*NODE_NAME \"a\"\n*MESH {\n*MESH_NUMVERTEX 4\n"
      "*MESH_NUMFACES 4\n*MESH_VERTEX_LIST {\n";
  for (int i = 0; i < 4; ++i)
    text += "*MESH_VERTEX " + std::to_string(i) + " " + std::to_string(kVertices[i][0]) + " " +
            std::to_string(kVertices[i][1]) + " " + std::to_string(kVertices[i][2]) + "\n";
  text += "}\n*MESH_FACE_LIST {\n";
  for (int i = 0; i < 4; ++i)
    text += "*MESH_FACE " + std::to_string(i) + ": A: " + std::to_string(kCorners[i][0]) +
            " B: " + std::to_string(kCorners[i][1]) + " C: " + std::to_string(kCorners[i][2]) +
            "\n";
  return text + "}\n}\n}\n";
}

TEST(ImportAxes, FormatsThatAssimpTurns) {
  expect_own_axes(load("a.3ds", tetrahedron_3ds()));
  expect_own_axes(load("a.3DS", tetrahedron_3ds()));
  expect_own_axes(load("a.dxf", tetrahedron_dxf()));
  expect_own_axes(load("a.ase", tetrahedron_ase()));
}

TEST(ImportAxes, OthersThatAssimpReads) {
  std::string x3d =
      "<?xml version=\"1.0\"?><X3D version='3.0'><Scene><Shape><IndexedFaceSet coordIndex='";
  for (const auto& triangle : kCorners)
    for (const int corner : {triangle[0], triangle[1], triangle[2], -1})
      x3d += std::to_string(corner) + " ";
  x3d += "'><Coordinate point='";
  for (const auto& vertex : kVertices)
    for (const float x : vertex) x3d += std::to_string(x) + " ";
  expect_own_axes(load("a.x3d", x3d + "'/></IndexedFaceSet></Shape></Scene></X3D>"));
}

/// The format itself says y up and metres.
TEST(ImportAxes, GltfDeclaresWhatItsSpecificationSays) {
  const TriangleMesh mesh = load("a.gltf", R"({"asset":{"version":"2.0"},"scene":0,
      "scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
      "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
      "bufferViews":[{"buffer":0,"byteLength":36}],
      "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,)"
                                           "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAAEAAAAAA"
                                           R"("}]})");
  EXPECT_EQ(mesh.declared.up_axis, 'Y');
  EXPECT_EQ(mesh.declared.unit, 1);
}

TEST(ImportAxes, AmfsUnitIsSaidToBeUnread) {
  std::string amf = "<?xml version=\"1.0\"?><amf unit=\"inch\"><object id=\"0\"><mesh><vertices>";
  for (const auto& [x, y, z] : kVertices)
    amf += "<vertex><coordinates><x>" + std::to_string(x) + "</x><y>" + std::to_string(y) +
           "</y><z>" + std::to_string(z) + "</z></coordinates></vertex>";
  amf += "</vertices><volume>";
  for (const auto& [a, b, c] : kCorners)
    amf += "<triangle><v1>" + std::to_string(a) + "</v1><v2>" + std::to_string(b) + "</v2><v3>" +
           std::to_string(c) + "</v3></triangle>";
  const TriangleMesh mesh = load("a.amf", amf + "</volume></mesh></object></amf>");
  ASSERT_EQ(mesh.notes.size(), 1u);
  EXPECT_NE(mesh.notes[0].find("unit"), std::string::npos) << mesh.notes[0];
  expect_own_axes(mesh);
}

/// Vertices unchanged; the declared axis and unit.
TEST(ImportAxes, FbxSaysWhichAxisIsUpAndItsUnit) {
  std::string fbx =
      "; FBX 7.4.0 project file\nFBXHeaderExtension:  {\n\tFBXHeaderVersion: 1003\n"
      "\tFBXVersion: 7400\n}\nGlobalSettings:  {\n\tVersion: 1000\n\tProperties70:  {\n"
      "\t\tP: \"UpAxis\", \"int\", \"Integer\", \"\",2\n"
      "\t\tP: \"UnitScaleFactor\", \"double\", \"Number\", \"\",2.5\n\t}\n}\nObjects:  {\n"
      "\tGeometry: 1, \"Geometry::\", \"Mesh\" {\n\t\tVertices: *12 {\n\t\t\ta: ";
  for (const auto& vertex : kVertices)
    for (const float x : vertex) fbx += std::to_string(x) + ",";
  fbx.back() = '\n';
  fbx += "\t\t}\n\t\tPolygonVertexIndex: *12 {\n\t\t\ta: ";
  for (const auto& [a, b, c] : kCorners)
    fbx += std::to_string(a) + "," + std::to_string(b) + "," + std::to_string(-1 - c) + ",";
  fbx.back() = '\n';
  fbx +=
      "\t\t}\n\t}\n\tModel: 2, \"Model::a\", \"Mesh\" {\n\t\tVersion: 232\n\t}\n}\n"
      "Connections:  {\n\tC: \"OO\",2,0\n\tC: \"OO\",1,2\n}\n";
  const TriangleMesh mesh = load("a.fbx", fbx);
  EXPECT_EQ(mesh.declared.up_axis, 'Z');
  EXPECT_EQ(mesh.declared.unit, 0.025);
  EXPECT_FALSE(mesh.declared.converted);
  expect_own_axes(mesh);
}

}  // namespace
}  // namespace ist
