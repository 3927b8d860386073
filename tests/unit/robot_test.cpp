#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <regex>
#include <string>

#include <ist/solid.h>
#include <ist/types.h>

#include "robots/description/link_mesh.h"
#include "robots/description/robot_model.h"
#include "robots/description/sphere_files.h"
#include "support/temp_file.h"

namespace ist::testing {
namespace {

RobotModel model_of(const std::string& text) { return read_robot(SourceFile{"r.urdf", text}); }

std::string model_error_of(const std::string& text) {
  try {
    model_of(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

std::string with_collision(const std::string& inside) {
  return "<robot name='r'>\n<link name='a'>\n<collision>\n" + inside +
         "</collision></link></robot>";
}

TEST(RobotModel, ReadsShapesAndPoses) {
  const RobotModel robot = model_of(
      "<?xml version='1.0'?><!-- a --><robot name='r&amp;s'><link name='base'>"
      "<collision><origin xyz='1 2 3' rpy='0 0 1.5707963267948966'/>"
      "<geometry><box size='2 4 6'/></geometry></collision>"
      "<visual><geometry><mesh filename='package://p/m.stl' scale='1 -2 3'/></geometry></visual>"
      "</link><link name='tip'><collision><geometry><cylinder radius='1' length='4'/></geometry>"
      "</collision><collision><geometry><sphere radius='0.5'/></geometry></collision></link>"
      "<joint name='j' type='fixed'><parent link='base'/><child link='tip'/></joint></robot>");
  EXPECT_EQ(robot.name, "r&s");
  ASSERT_EQ(robot.links.size(), 2u);
  const PlacedLinkShape& box = robot.links[0].collision[0];
  EXPECT_EQ(std::get<LinkBox>(box.shape).half_extents, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(box.translation, Eigen::Vector3d(1, 2, 3));
  EXPECT_TRUE((box.rotation * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY()));
  EXPECT_EQ(std::get<LinkMesh>(robot.links[0].visual[0].shape).scale, Eigen::Vector3d(1, -2, 3));
  EXPECT_EQ(std::get<LinkCylinder>(robot.links[1].collision[0].shape).half_height, 2);
  EXPECT_EQ(std::get<LinkBall>(robot.links[1].collision[1].shape).radius, 0.5);
}

TEST(RobotModel, SaysWhatIsWrongAndWhere) {
  const auto expect = [](const std::string& text, const std::string& message) {
    EXPECT_NE(model_error_of(text).find(message), std::string::npos) << model_error_of(text);
  };
  expect("<robot name='r'></robot>", "contains no <link>");
  expect("<scene/>", "is not a robot");
  expect("<robot><link name='a'>", "line 1: <link>: the file ends early");
  expect("<!DOCTYPE r [<!ENTITY a 'b'>]><robot/>", "entities are refused");
  expect("<robot><link/></robot>", "has no name");
  expect("<robot><link name='a'/><link name='a'/></robot>", "duplicates the link");
  expect("<robot><link name='a'/><link name='b'/></robot>", "2 links without a parent");
  expect("<robot><link name='a'/><joint><parent link='a'/><child link='x'/></joint></robot>",
         "its child \"x\" is not a link");
  expect(
      "<robot><link name='a'/><joint type='fixed'><parent link='a'/><child "
      "link='a'/></joint></robot>",
      "a cycle");
  expect(with_collision(""), "line 3: <collision>: has no <geometry>");
  expect(with_collision("<geometry><blob/></geometry>"), "is not read. Use mesh, box");
  expect(with_collision("<geometry><box size='1 1'/></geometry>"), "has 2 numbers, not 3");
  expect(with_collision("<geometry><box size='1 1 0'/></geometry>"), "must be above 0");
  expect(with_collision("<geometry><sphere radius='-1'/></geometry>"), "must be above 0");
  expect(with_collision("<geometry><sphere radius='inf'/></geometry>"), "not a finite number");
  expect(with_collision("<geometry><sphere/></geometry>"), "has 0 numbers");
  expect(with_collision("<origin xyz='0 nan 0'/><geometry><sphere radius='1'/></geometry>"),
         "line 4: <origin>: xyz: \"nan\" is not a finite number");
  expect(with_collision("<geometry><mesh/></geometry>"), "has no file");
  expect(with_collision("<geometry><mesh filename='m.stl' scale='0 1 1'/></geometry>"),
         "a scale of 0");
}

const char* const kTetrahedron =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

TEST(RobotModel, FindsPackagesAndTurnsMirroredMeshes) {
  const TempFile mesh("m.obj", kTetrahedron);
  const std::filesystem::path folder = std::filesystem::path(mesh.path()).parent_path();
  const PackagePaths here(folder / "r.urdf", {}, "");
  EXPECT_EQ(here.find("m.obj"), mesh.path());
  EXPECT_EQ(here.find("file://" + mesh.path()), mesh.path());
  EXPECT_EQ(here.find("package://" + folder.filename().string() + "/m.obj"), mesh.path());
  const PackagePaths named("/nowhere/r.urdf", {{"p", folder.string()}}, "");
  EXPECT_EQ(named.find("package://p/m.obj"), mesh.path());
  const PackagePaths ros("/nowhere/r.urdf", {}, "/none:" + folder.parent_path().string());
  EXPECT_EQ(ros.find("package://" + folder.filename().string() + "/m.obj"), mesh.path());
  EXPECT_THROW(ros.find("package://q/m.obj"), Error);
  EXPECT_THROW(here.find("no.obj"), Error);
  EXPECT_THROW(here.find("package://"), Error);

  PlacedLinkShape placed;
  placed.shape = LinkMesh{"m.obj", {-2, 1, 3}};
  placed.translation = {5, 0, 0};
  const ClosedMesh closed = close_mesh(mesh_of(placed, here, "r.urdf").mesh, "mirrored");
  EXPECT_EQ(closed.report.flipped_components, 0u);
  EXPECT_NEAR(make_solid(closed)->volume(), 1, 1e-12);
  EXPECT_EQ(make_solid(closed)->bounds().min().x(), 3);
}

/// The contents of public robots.
TEST(RobotModel, UnusedFaultsAndUnusualNames) {
  const RobotModel robot = model_of(
      "<robot name='r'><link name='a'><visual><geometry><box size='0 0 0'/></geometry></visual>"
      "<collision><geometry><capsule radius='1' "
      "length='4'/></geometry></collision></link></robot>");
  EXPECT_NE(std::get<LinkFault>(robot.links[0].visual[0].shape).what.find("must be above 0"),
            std::string::npos);
  EXPECT_EQ(std::get<LinkCapsule>(robot.links[0].collision[0].shape).half_height, 2);

  const TempFile mesh("a b.obj", kTetrahedron);
  const std::filesystem::path path = mesh.path(), folder = path.parent_path();
  const std::string package = folder.filename().string(), file = path.filename().string(),
                    coded = std::regex_replace(file, std::regex(" "), "%20");
  const PackagePaths here(folder / "r.urdf", {}, "");
  EXPECT_EQ(here.find(coded), mesh.path());
  EXPECT_EQ(here.find("package:///" + package + "/" + coded), mesh.path());
  EXPECT_EQ(here.find("model://" + package + "/" + file), mesh.path());
  EXPECT_THROW(here.find("no%2"), Error);
}

TEST(RobotModel, ACapsulesMeshHoldsIt) {
  PlacedLinkShape placed;
  placed.shape = LinkCapsule{2, 3};
  const ShapeMesh shape = mesh_of(placed, PackagePaths("r.urdf", {}, ""), "r.urdf");
  const auto solid = make_solid(close_mesh(shape.mesh, "capsule"));
  for (int i = 0; i < 1000; ++i) {
    const double z = 0.002 * i - 1, r = std::sqrt(1 - z * z), a = 2.4 * i;
    const Eigen::Vector3d x(2 * r * std::cos(a), 2 * r * std::sin(a), 2 * z + (z < 0 ? -3 : 3));
    EXPECT_LE(solid->signed_distance(x), 1e-12);
    EXPECT_GE(solid->signed_distance(x), -shape.slack);
  }
  EXPECT_LT(shape.slack, 0.01);
}

TEST(RobotModel, ACylindersMeshHoldsIt) {
  PlacedLinkShape placed;
  placed.shape = LinkCylinder{2, 3};
  const ShapeMesh shape = mesh_of(placed, PackagePaths("r.urdf", {}, ""), "r.urdf");
  const auto solid = make_solid(close_mesh(shape.mesh, "cylinder"));
  for (int i = 0; i < 1000; ++i)
    EXPECT_LE(solid->signed_distance({2 * std::cos(0.01 * i), 2 * std::sin(0.01 * i), 0}), 1e-12);
  EXPECT_LT(shape.slack, 2e-3);
}

TEST(SphereFiles, UrdfKeepsAllButItsCollisions) {
  const std::string text =
      "<robot name='r'>\n  <link name='a'>\n    <inertial/>\n    <collision>\n      <geometry>"
      "<box size='1 1 1'/></geometry>\n    </collision>\n    <collision><geometry><sphere "
      "radius='1'/></geometry></collision>\n  </link>\n  <!-- kept -->\n</robot>\n";
  const std::string out =
      urdf_with_spheres(model_of(text), std::vector<LinkSpheres>{{"a", {{{1, 2, 3}, 0.25}}}});
  EXPECT_EQ(out,
            "<robot name='r'>\n  <link name='a'>\n    <inertial/>\n    <collision "
            "name=\"a_sphere_0\"><origin xyz=\"1 2 3\" rpy=\"0 0 0\"/><geometry><sphere "
            "radius=\"0.25\"/></geometry></collision>\n  </link>\n  <!-- kept -->\n</robot>\n");
}

TEST(SphereFiles, RelativeMeshesAreFoundFromAnotherFolder) {
  const std::string text =
      "<robot name='r'><link name='a'><visual><geometry><mesh filename='../m/x.stl'/></geometry>"
      "</visual><collision><geometry><mesh filename='../m/x.stl'/></geometry></collision></link>"
      "</robot>";
  const RobotModel robot = read_robot(SourceFile{"/robots/u/r.urdf", text});
  const std::vector<LinkSpheres> spheres = {{"a", {{{1, 2, 3}, 0.25}}}};
  EXPECT_NE(urdf_with_spheres(robot, spheres, "/out").find("filename='../robots/m/x.stl'"),
            std::string::npos);
  EXPECT_NE(urdf_with_spheres(robot, spheres, "/robots/u").find("filename='../m/x.stl'"),
            std::string::npos);
}

}  // namespace
}  // namespace ist::testing
