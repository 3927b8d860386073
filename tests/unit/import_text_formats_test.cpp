#include <gtest/gtest.h>

#include <array>
#include <clocale>
#include <cstring>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <ist/mesh.h>
#include <ist/types.h>

#include "support/temp_file.h"

namespace ist {
namespace {

using testing::TempFile;

TriangleMesh load_text(const std::string& name, const std::string& bytes) {
  return load_mesh(TempFile(name, bytes).path());
}

std::string error_of(const std::string& name, const std::string& bytes) {
  try {
    load_text(name, bytes);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

#define EXPECT_ERROR(name, bytes, words) \
  EXPECT_NE(error_of(name, bytes).find(words), std::string::npos) << error_of(name, bytes)

// A tetrahedron, with the corners that each format requires.
const std::string kObj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
const std::string kObjFaces = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

void expect_tetrahedron(const TriangleMesh& mesh) {
  EXPECT_EQ(mesh.vertices.size(), 4u);
  EXPECT_EQ(mesh.triangles.size(), 4u);
  EXPECT_NEAR(close_mesh(mesh, "tetrahedron").report.volume, 1.0 / 6, 1e-15);
}

TEST(ReadObj, Grammar) {
  expect_tetrahedron(load_text("a.obj", kObj + kObjFaces));
  expect_tetrahedron(load_text("a.OBJ", kObjFaces + kObj));  // faces first
  expect_tetrahedron(
      load_text("a.obj", "\xef\xbb\xbf# c\r\nmtllib x\r\n" + kObj +
                             "vn 0 0 1\nvt 0 0\no a\ng b\nusemtl m\ns off\n"
                             "f 1/1 3/1 2/1\nf 1//1 2//1 4//1\nf -3/1/1 -2/1/1 -1/1/1\n"
                             "f 1 4 \\\n 3"));
  expect_tetrahedron(
      load_text("a.obj", "v 0 0 0 1 0 0\nv +1 0 0\nv 0 1e0 0 # one\nv 0 0 .1e1\n" + kObjFaces));
}

const std::string kStl = [] {
  const char* const corners[4] = {"0 0 0", "1 0 0", "0 1 0", "0 0 1"};
  std::string text = "solid s\n";
  for (const auto& [a, b, c] : {std::array{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const int corner : {a, b, c}) text += std::string("vertex ") + corners[corner] + "\n";
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid s\n";
}();
const std::string kOff =
    "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
const std::string kPlyStart =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\n";
const std::string kSquareFaces = "element face 4\nproperty list uchar int vertex_indices\n";
const std::string kPlyVertices = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
const std::string kPly = kPlyStart + kSquareFaces + "end_header\n" + kPlyVertices +
                         "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";

TEST(ReadText, AnyLineEndsAndAByteOrderMark) {
  const std::pair<const char*, std::string> files[] = {
      {"a.obj", "# c\n" + kObj + kObjFaces}, {"a.stl", kStl}, {"a.off", kOff}, {"a.ply", kPly}};
  for (const auto& [name, text] : files)
    for (const char* const mark : {"", "\xef\xbb\xbf"})
      for (const char* const end : {"\n", "\r", "\r\n", "\r\r\n"}) {
        std::string bytes = mark;
        for (const char c : text) bytes += c == '\n' ? end : std::string(1, c);
        SCOPED_TRACE(std::string(name) + (*mark ? " marked " : " ") +
                     std::to_string(std::strlen(end)));
        expect_tetrahedron(load_text(name, bytes));
      }
}

TEST(ReadText, AFileOfAnotherFormatIsNamedAsSuch) {
  const std::string glb = std::string("glTF\2\0\0\0", 8) + std::string(200, '\7');
  for (const char* const name : {"a.stl", "a.obj", "a.ply", "a.off", "a.dae"})
    EXPECT_ERROR(name, glb, "holds a binary glTF");
  EXPECT_ERROR("a.obj", kStl, "holds STL");
  EXPECT_ERROR("a.stl", kPly, "holds PLY");
  EXPECT_ERROR("a.stl", kObj + kObjFaces, "is text, and no STL");
  EXPECT_ERROR("a.stl", std::string("\xff\xfes\0o\0l\0i\0d\0", 12), "UTF-16");
  EXPECT_ERROR("a.stl", std::string(100, '\1') + '\0', "or is no STL");
  // A binary STL may say anything in its header.
  std::string binary = "glTF";
  binary.resize(80);
  const std::uint32_t count = 1;
  binary.append(reinterpret_cast<const char*>(&count), 4);
  const float facet[12] = {0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0};
  binary.append(reinterpret_cast<const char*>(facet), 48).append(2, '\0');
  EXPECT_EQ(load_text("a.stl", binary).triangles.size(), 1u);
  EXPECT_TRUE(load_text("a.stl", binary).notes.empty());
  binary.replace(0, 4, "free");
  const TriangleMesh more = load_text("a.stl", binary + std::string(100, '\1'));
  ASSERT_EQ(more.notes.size(), 1u);
  EXPECT_NE(more.notes[0].find("100 bytes behind the 1 triangle"), std::string::npos);
}

TEST(ReadText, WhatIsNotReadIsNamed) {
  const auto notes = [](const std::string& name, const std::string& bytes) {
    const TriangleMesh mesh = load_text(name, bytes);
    std::string all;
    for (const std::string& note : mesh.notes) all += note + "; ";
    return all;
  };
  EXPECT_EQ(notes("a.obj", kObj + kObjFaces + "l 1 2\np 1\nvp 1\ncstype bezier\n"), "");
  EXPECT_NE(notes("a.obj", kObj + kObjFaces + "surf 0 1 0 1 1 2\nsurf 0 1 0 1 1 2\ncall x\n")
                .find("\"call\" are not read: they name other files; lines of \"surf\""),
            std::string::npos);
  EXPECT_EQ(notes("a.ply", kPly), "");
  const std::string grid = "element range_grid 1\nproperty list uchar int vertex_indices\n";
  EXPECT_NE(notes("a.ply", kPlyStart + kSquareFaces + grid + "end_header\n" + kPlyVertices +
                               "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n1 0\n")
                .find("\"range_grid\""),
            std::string::npos);
}

TEST(ReadPly, StripsOfTriangles) {
  const std::string strips = "element tristrips 1\nproperty list int int vertex_indices\n";
  expect_tetrahedron(
      load_text("a.ply", kPlyStart + strips + "end_header\n" + kPlyVertices + "6 0 2 1 3 0 2\n"));
  const TriangleMesh parted = load_text(
      "a.ply", kPlyStart + strips + "end_header\n" + kPlyVertices + "9 0 2 1 3 -1 2 0 3 -1\n");
  EXPECT_EQ(parted.triangles.size(), 3u);
  const TriangleMesh whole =
      load_text("a.ply", kPlyStart + kSquareFaces + strips + "end_header\n" + kPlyVertices +
                             "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n0\n");
  expect_tetrahedron(whole);
  EXPECT_ERROR("a.ply", kPlyStart + strips + "end_header\n" + kPlyVertices + "3 0 1 4\n",
               "corner 2 is not a vertex");
}

TEST(ReadObj, KeepsAllDigitsOfADouble) {
  const TriangleMesh mesh =
      load_text("a.obj", "v 1000000.0000001234 0.1 1e-300\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(mesh.vertices[0], Eigen::Vector3d(1000000.0000001234, 0.1, 1e-300));
}

TEST(ReadObj, ReadsPointsWhateverTheLocale) {
  const std::string before = std::setlocale(LC_ALL, nullptr);
  for (const char* name : {"de_DE.UTF-8", "fr_FR.UTF-8"}) std::setlocale(LC_ALL, name);
  EXPECT_EQ(load_text("a.obj", "v 1.5 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n").vertices[0][0], 1.5);
  std::setlocale(LC_ALL, before.c_str());
}

TEST(ReadObj, ErrorsNameTheLine) {
  EXPECT_ERROR("a.obj", kObj + "f 1 2 5\n", "line 5: vertex 5 does not exist");
  EXPECT_ERROR("a.obj", kObj + "f 1 2 -5\n", "line 5: vertex -5 does not exist");
  EXPECT_ERROR("a.obj", kObj + "f 0 1 2\n", "line 5: vertex 0 does not exist");
  EXPECT_ERROR("a.obj", kObj + "f 1 2\n", "line 5: a face needs three");
  EXPECT_ERROR("a.obj", "v 0 0\nf 1 1 1\n", "line 1: a number is missing");
  EXPECT_ERROR("a.obj", "v 0 0 1,5\nf 1 1 1\n", "line 1: \"1,5\" is not a number");
  EXPECT_ERROR("a.obj", "v 0 0 0\nv 0 nan 0\nv 1 0 0\nf 1 2 3\n", "line 2: vertex 1");
  EXPECT_ERROR("a.obj", "v 0 0 0\nv 0 1e999 0\nv 1 0 0\nf 1 2 3\n", "line 2: vertex 1");
  EXPECT_ERROR("a.obj", kObj, "no faces");
  EXPECT_ERROR("a.obj", "", "empty file");
}

TEST(ReadObj, IgnoresWhatNoFaceUses) {
  const TriangleMesh mesh = load_text("a.obj", kObj + "v nan 1e400 0\nv 1e20 0 0\n" + kObjFaces);
  expect_tetrahedron(mesh);
}

TEST(ReadObj, ConcavePolygonKeepsItsShape) {
  // An L, and an arrow head whose first corner sees not all of it.
  const std::string l = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\n";
  for (const std::string face : {"f 1 2 3 4 5 6\n", "f 3 4 5 6 1 2\n", "f 5 6 1 2 3 4\n"}) {
    const TriangleMesh mesh = load_text("a.obj", l + face);
    double area = 0;
    for (const auto& t : mesh.triangles) {
      const auto& v = mesh.vertices;
      const double z = (v[t[1]] - v[t[0]]).cross(v[t[2]] - v[t[0]])[2] / 2;
      EXPECT_GT(z, 0) << face;
      area += z;
    }
    EXPECT_DOUBLE_EQ(area, 3) << face;
    EXPECT_EQ(mesh.triangles.size(), 4u);
  }
}

// Teeth: every second corner is reflex. Cutting ears must not take the cube of their number.
TEST(ReadObj, ManyLargeConcavePolygonsAreReadSoon) {
  std::ostringstream text;
  constexpr int kTeeth = 990, kCopies = 20;
  for (int i = 0; i < kTeeth; ++i) text << "v " << i << " 1 0\nv " << i << ".5 0.1 0\n";
  text << "v 990 -1 0\nv 0 -1 0\n";
  for (int copy = 0; copy < kCopies; ++copy) {
    text << 'f';
    for (int i = 2 * kTeeth + 2; i > 0; --i) text << ' ' << i;
    text << '\n';
  }
  const TriangleMesh mesh = load_text("a.obj", text.str());
  ASSERT_EQ(mesh.triangles.size(), std::size_t{kCopies} * 2 * kTeeth);
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const double signed_area =
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).z() / 2;
    EXPECT_GE(signed_area, 0);
    area += signed_area / kCopies;
  }
  // The shoelace formula: teeth, then down to y = −1 and back.
  double expected = 0;
  std::vector<Eigen::Vector2d> corners;
  for (int i = 0; i < kTeeth; ++i) {
    corners.emplace_back(i, 1);
    corners.emplace_back(i + 0.5, 0.1);
  }
  corners.emplace_back(990, -1);
  corners.emplace_back(0, -1);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d &p = corners[i], &q = corners[(i + 1) % corners.size()];
    expected -= (p.x() * q.y() - p.y() * q.x()) / 2;
  }
  EXPECT_NEAR(area, expected, 1e-9 * expected);
}

TEST(ReadOff, Grammar) {
  const std::string body =
      "4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
  expect_tetrahedron(load_text("a.off", "OFF\n" + body));
  expect_tetrahedron(load_text("a.off", "# c\nOFF " + body));
  expect_tetrahedron(
      load_text("a.off", "OFF 4 4 6 0 0 0 1 0 0 0 1 0 0 0 1 3 0 2 1 3 0 1 3 3 1 2 3 3 0 3 2"));
  expect_tetrahedron(load_text("a.off",
                               "COFF\n4 4 6\n0 0 0 255 0 0 1\n1 0 0 9 9 9 1\n0 1 0 1 1 1 1\n"
                               "0 0 1 1 1 1 1\n3 0 2 1 255 0 0\n3 0 1 3\n3 1 2 3 7\n3 0 3 2\n"));
  expect_tetrahedron(load_text("a.off",
                               "NOFF\n4 4 6\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n"
                               "0 0 1 0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"));
}

TEST(ReadOff, Errors) {
  EXPECT_ERROR("a.off", "4 4 6\n", "does not begin with OFF");
  EXPECT_ERROR("a.off", "4OFF\n1 1 1\n", "does not begin with OFF");
  EXPECT_ERROR("a.off", "OFF BINARY\n", "binary OFF");
  EXPECT_ERROR("a.off", "OFF\n-1 1 0\n", "negative");
  EXPECT_ERROR("a.off", "OFF\n3 4000000000 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "too short");
  EXPECT_ERROR("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "line 6: face 0: vertex 3");
  EXPECT_ERROR("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n9 0 1 2\n", "fewer than the 9 corners");
  EXPECT_ERROR("a.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "ends early");
}

std::string stl_facet(const char* corners) {
  std::string text = "facet normal 0 0 0\nouter loop\n";
  const std::string list = corners;
  for (std::size_t i = 0; i < list.size(); ++i) {
    text += "vertex";
    for (int k = 0; k < 3; ++k) text += list[i] == "xyz"[k] ? " 1" : " 0";
    text += "\n";
  }
  return text + "endloop\nendfacet\n";
}

std::string stl_text() {
  return "solid a name with facet in it\n" + stl_facet("oyx") + stl_facet("oxz") +
         stl_facet("xyz") + stl_facet("ozy") + "endsolid a\n";
}

std::string stl_binary(const std::string& header = "") {
  std::string bytes = header;
  bytes.resize(80, ' ');
  const std::uint32_t count = 4;
  bytes.append(reinterpret_cast<const char*>(&count), 4);
  for (const std::string facet : {"oyx", "oxz", "xyz", "ozy"}) {
    bytes.append(12, '\0');
    for (const char c : facet)
      for (const char axis : {'x', 'y', 'z'}) {
        const float value = c == axis ? 1.f : 0.f;
        bytes.append(reinterpret_cast<const char*>(&value), 4);
      }
    bytes.append(2, '\0');
  }
  return bytes;
}

TEST(ReadStl, TextAndBinary) {
  expect_tetrahedron(load_text("a.stl", stl_text()));
  std::string upper = stl_text();
  for (char& c : upper) c = static_cast<char>(std::toupper(c));
  expect_tetrahedron(load_text("a.STL", upper));
  expect_tetrahedron(load_text("a.stl", stl_binary()));
  expect_tetrahedron(load_text("a.stl", stl_binary("solid exported by something")));
  expect_tetrahedron(load_text("a.stl", stl_binary("solid") + "trailing"));
}

TEST(ReadStl, Errors) {
  EXPECT_ERROR("a.stl", stl_text().substr(0, 200), "the file ends early");
  EXPECT_ERROR("a.stl", stl_binary().substr(0, 200), "the file ends early");
  EXPECT_ERROR("a.stl", stl_binary().substr(0, 83), "the file ends early");
  EXPECT_ERROR("a.stl", "solid a\nfacet abnormal 0 0 0\n", "line 2: expected \"normal\"");
  EXPECT_ERROR("a.stl", "solid a\nendsolid a\n", "no faces");
  std::string lying = stl_binary();
  std::memset(lying.data() + 80, 0xff, 4);
  EXPECT_ERROR("a.stl", lying, "4294967295 triangles need 214748364834 bytes");
}

TEST(LoadMesh, WeldsWithinTheStatedFractionOfTheDiagonal) {
  const std::string cracked =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1.00001 0 0\n"
      "f 1 3 2\nf 1 5 4\nf 2 3 4\nf 1 4 3\n";
  const TempFile file("a.obj", cracked);
  EXPECT_EQ(load_mesh(file.path()).vertices.size(), 5u);
  EXPECT_EQ(load_mesh(file.path(), {.weld_tolerance = 1e-6}).vertices.size(), 5u);
  expect_tetrahedron(load_mesh(file.path(), {.weld_tolerance = 1e-4}));
  EXPECT_THROW(load_mesh(file.path(), {.weld_tolerance = -1}), Error);
}

TEST(OtherContent, IsNamed) {
  EXPECT_ERROR("a.stl", "\x89PNG\r\n\x1a\n", "PNG image");
  EXPECT_ERROR("a.ply", "version https://git-lfs.github.com/spec/v1\n", "git lfs pull");
  EXPECT_ERROR("a.obj", "\n<!DOCTYPE html><html>", "web page");
  EXPECT_ERROR("a.obj", stl_binary(), "binary data");
  EXPECT_ERROR("a.mesh7", "v 0 0 0", "no mesh format ends in");
  EXPECT_ERROR("a.step", "ISO-10303-21;\nHEADER;\n", "Make a GLB of it");
  EXPECT_THROW(load_mesh("/nonexistent/a.obj"), Error);
  EXPECT_THROW(load_mesh(::testing::TempDir()), Error);
}

}  // namespace
}  // namespace ist
