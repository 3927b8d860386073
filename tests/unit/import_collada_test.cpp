#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include <ist/mesh.h>
#include <ist/types.h>

#include "support/temp_file.h"

namespace ist {
namespace {

using testing::TempFile;

constexpr const char* kInstance = "<instance_geometry url='#g'/>";

/// A tetrahedron of volume 1/6, its right angle at the origin, in the given scene.
std::string collada(const std::string& nodes, const std::string& library = "",
                    const std::string& asset = "<unit meter='1'/><up_axis>Y_UP</up_axis>") {
  return "<?xml version=\"1.0\"?>\n<COLLADA version=\"1.4.1\">\n<asset>" + asset +
         "</asset>\n<library_geometries><geometry id='g'><mesh><source id='p'>\n"
         "<float_array id='a' count='12'>0 0 0 1 0 0 0 1 0 0 0 1</float_array>\n"
         "<technique_common><accessor source='#a' count='4' stride='3'><param name='X'/>"
         "<param name='Y'/><param name='Z'/></accessor></technique_common></source>\n"
         "<vertices id='v'><input semantic='POSITION' source='#p'/></vertices>\n"
         "<triangles count='4'><input semantic='VERTEX' source='#v' offset='0'/>\n"
         "<p>0 2 1 0 1 3 1 2 3 0 3 2</p></triangles></mesh></geometry></library_geometries>" +
         library + "<library_visual_scenes><visual_scene id='s'>" + nodes +
         "</visual_scene></library_visual_scenes>\n"
         "<scene><instance_visual_scene url='#s'/></scene></COLLADA>\n";
}

ClosedMesh closed(const std::string& content) {
  const TempFile file("a.dae", content);
  return close_mesh(load_mesh(file.path()), "a.dae");
}

std::string message_of(const std::string& content) {
  const TempFile file("a.dae", content);
  try {
    load_mesh(file.path());
  } catch (const Error& error) {
    return error.what();
  }
  return "loaded";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string repeated(const std::string& text, std::size_t times) {
  std::string result;
  for (std::size_t i = 0; i < times; ++i) result += text;
  return result;
}

const std::string kOne = collada(std::string("<node>") + kInstance + "</node>");

void expect_corner(const ClosedMesh& mesh, const Eigen::Vector3d& low,
                   const Eigen::Vector3d& high) {
  EXPECT_TRUE(mesh.report.bounds.min().isApprox(low, 1e-15) ||
              (mesh.report.bounds.min() - low).norm() < 1e-15)
      << mesh.report.bounds.min().transpose();
  EXPECT_TRUE((mesh.report.bounds.max() - high).norm() < 1e-15)
      << mesh.report.bounds.max().transpose();
}

TEST(ImportCollada, TransformsAreApplied) {
  expect_corner(closed(kOne), {0, 0, 0}, {1, 1, 1});
  const auto with = [&](const std::string& transform) {
    return closed(collada("<node>" + transform + "<node>" + kInstance + "</node></node>"));
  };
  expect_corner(with("<translate>1 2 3</translate><scale>2 2 2</scale>"), {1, 2, 3}, {3, 4, 5});
  // A quarter turn about z is exact: x becomes y, y becomes −x.
  expect_corner(with("<rotate>0 0 2 90</rotate>"), {-1, 0, 0}, {0, 1, 1});
  expect_corner(with("<rotate>0 0 1 -450</rotate>"), {0, -1, 0}, {1, 0, 1});
  expect_corner(with("<matrix>0 -1 0 5 1 0 0 0 0 0 1 0 0 0 0 1</matrix>"), {4, 0, 0}, {5, 1, 1});
  const ClosedMesh turned = with("<rotate>1 2 3 77</rotate><scale>-1 1 2</scale>");
  EXPECT_NEAR(turned.report.volume, 2.0 / 6, 1e-14);
  EXPECT_EQ(turned.report.flipped_components, 0u);
}

TEST(ImportCollada, KeepsTheDigitsOfDoubles) {
  const ClosedMesh mesh = closed(
      replaced(kOne, ">0 0 0 1 0 0 0 1 0", ">1000000 0 0 1000000.000123456789 0 0 1000000 1 0"));
  EXPECT_EQ(mesh.report.bounds.max().x(), 1000000.000123456789);
}

TEST(ImportCollada, TheUnitScalesAndTheUpAxisTurnsNothing) {
  const std::string node =
      "<node><translate>1 2 3</translate>" + std::string(kInstance) + "</node>";
  for (const char up : {'X', 'Y', 'Z'}) {
    const TempFile file(
        "a.dae",
        collada(node, "", std::string("<unit meter='0.5'/><up_axis> ") + up + "_UP\n</up_axis>"));
    const TriangleMesh mesh = load_mesh(file.path());
    EXPECT_EQ(mesh.declared.up_axis, up);
    EXPECT_EQ(mesh.declared.unit, 0.5);
    expect_corner(close_mesh(mesh, "a.dae"), {0.5, 1, 1.5}, {1, 1.5, 2});
  }
  // A skin is placed by its own matrix, on the same axes.
  const std::string skin =
      "<library_controllers><controller id='c'><skin source='#g'><bind_shape_matrix>1 0 0 9 0 1 0 "
      "0 0 0 1 0 0 0 0 1</bind_shape_matrix></skin></controller></library_controllers>";
  expect_corner(closed(collada("<node><instance_controller url='#c'/></node>", skin,
                               "<unit meter='0.5'/><up_axis>Z_UP</up_axis>")),
                {4.5, 0, 0}, {5, 0.5, 0.5});
  const TempFile file("a.dae", collada(node, "", ""));
  EXPECT_EQ(load_mesh(file.path()).declared.up_axis, 0);
  EXPECT_EQ(load_mesh(file.path()).declared.unit, 0);
}

TEST(ImportCollada, PrimitivesOfEveryKind) {
  const std::string old =
      "<triangles count='4'><input semantic='VERTEX' source='#v' offset='0'/>\n"
      "<p>0 2 1 0 1 3 1 2 3 0 3 2</p></triangles>";
  const std::string input = "<input semantic='VERTEX' source='#v' offset='1'/>";
  for (const std::string& primitives :
       {"<polylist count='4'>" + input +
            "<vcount>3 3 3 3</vcount>"
            "<p>9 0 9 2 9 1 9 0 9 1 9 3 9 1 9 2 9 3 9 0 9 3 9 2</p></polylist>",
        "<polygons count='4'>" + input +
            "<p>9 0 9 2 9 1</p><p>9 0 9 1 9 3</p><p>9 1 9 2 9 3</p>"
            "<p>9 0 9 3 9 2</p></polygons>",
        "<trifans count='1'>" + input +
            "<p>9 0 9 2 9 1 9 3 9 2</p></trifans><tristrips count='1'>" + input +
            "<p>9 1 9 2 9 3</p></tristrips><lines count='1'>" + input + "<p>9 0 9 1</p></lines>"}) {
    const ClosedMesh mesh = closed(replaced(kOne, old, primitives));
    EXPECT_EQ(mesh.report.triangles, 4u);
    EXPECT_NEAR(mesh.report.volume, 1.0 / 6, 1e-15);
  }
}

TEST(ImportCollada, InstancesOfNodesAndSkins) {
  const std::string library =
      "<library_nodes><node id='n'><translate>5 0 0</translate>" + std::string(kInstance) +
      "</node></library_nodes><library_controllers><controller id='c'><skin source='#g'>"
      "<bind_shape_matrix>1 0 0 9 0 1 0 0 0 0 1 0 0 0 0 1</bind_shape_matrix></skin></controller>"
      "</library_controllers>";
  const ClosedMesh mesh = closed(collada(
      "<node><instance_node url='#n'/><node><translate>0 3 0</translate><instance_node url='#n'/>"
      "</node><node><translate>7 7 7</translate><instance_controller url='#c'/></node></node>",
      library));
  EXPECT_EQ(mesh.report.components, 3u);
  expect_corner(mesh, {5, 0, 0}, {10, 4, 1});
}

TEST(ImportCollada, WhatIsWrongIsNamed) {
  const std::string node = std::string("<node>") + kInstance + "</node>";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {kOne.substr(0, 700), "the file ends early"},
      {replaced(kOne, "</mesh>", "</mash>"), "line 9: closes \"mash\", which is not open"},
      {replaced(kOne, "<COLLADA", "<!DOCTYPE a [<!ENTITY b \"c\">]><COLLADA"),
       "line 2: document types and entities are refused"},
      {"<svg></svg>", "is not COLLADA: its root is \"svg\""},
      {replaced(kOne, "<p>0 2", "<p>-1 2"), "line 9: <p>: \"-1\" is not a whole number"},
      {replaced(kOne, "<p>0 2", "<p>4 2"), "line 9: <p>: refers to vertex 4 of 4"},
      {replaced(kOne, "<p>0 2", "<p>2"), "11 corners are not a multiple of three"},
      {replaced(kOne, "triangles count='4'", "triangles count='1000000000'"),
       "announces 1000000000 and holds 4"},
      {replaced(kOne, "offset='0'", "offset='4000000000'"), "its offset is beyond"},
      {replaced(kOne, "count='4' stride", "count='1000000000' stride"), "do not fit into an array"},
      {replaced(kOne, "count='4' stride", "count='5' stride"), "do not fit into an array"},
      {replaced(kOne, "stride='3'", "stride='0'"), "its stride is too small"},
      {replaced(kOne, "stride='3'", "stride='18446744073709551615'"), "do not fit into an array"},
      {replaced(kOne, ">0 0 0 1", ">0 0 x 1"), "line 5: <float_array>: \"x\" is not a number"},
      {replaced(kOne, ">0 0 0 1", ">nan 0 0 1"), "infinite or not a number"},
      {replaced(kOne, "url='#g'", "url='#h'"), "refers to \"#h\", which is not a geometry"},
      {replaced(kOne, "url='#g'", "url='http://x/#h'"), "not to an element of this file"},
      {collada("<node><matrix>1 0 0</matrix></node>"), "3 numbers instead of 16"},
      {collada("<node><skew>1 2 3 4 5 6 7</skew></node>"), "<skew>: is not supported"},
      {collada("<node/>"), "no faces"},
  };
  for (const auto& [content, expected] : cases) {
    const std::string message = message_of(content);
    EXPECT_NE(message.find("a.dae: "), std::string::npos) << message;
    EXPECT_NE(message.find(expected), std::string::npos) << expected << "\n" << message;
  }
}

// Each of these ended a reader of another library in a crash, a hang or gigabytes.
TEST(ImportCollada, AbsurdStructureIsRefusedSoon) {
  constexpr std::size_t kMany = 200'000;
  EXPECT_NE(message_of(collada(repeated("<node>", kMany) + kInstance + repeated("</node>", kMany)))
                .find("nested more than 1000 deep"),
            std::string::npos);
  const std::string holds_itself =
      "<library_nodes><node id='n'><instance_node url='#n'/></node></library_nodes>";
  EXPECT_NE(message_of(collada("<node><instance_node url='#n'/></node>", holds_itself))
                .find("Check that no node contains itself"),
            std::string::npos);
  std::string doubling = "<library_nodes>";
  for (int i = 0; i < 40; ++i) {
    const std::string next = "<instance_node url='#n" + std::to_string(i + 1) + "'/>";
    doubling += "<node id='n" + std::to_string(i) + "'>" + next + next + "</node>";
  }
  doubling += std::string("<node id='n40'>") + kInstance + "</node></library_nodes>";
  const std::string message =
      message_of(collada("<node><instance_node url='#n0'/></node>", doubling));
  EXPECT_NE(message.find("Check that no node contains itself"), std::string::npos) << message;
}

}  // namespace
}  // namespace ist
