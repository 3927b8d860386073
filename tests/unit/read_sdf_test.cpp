#include <gtest/gtest.h>

#include <numbers>
#include <string>

#include <ist/types.h>

#include "robots/description/kinematics.h"
#include "robots/description/robot_model.h"

// Robots of SDF.

namespace ist::testing {
namespace {

using Eigen::Vector3d;

RobotModel sdf(const std::string& inside) {
  return read_robot(
      SourceFile{"m.sdf", "<sdf version='1.9'><model name='m'>" + inside + "</model></sdf>"});
}

std::string sdf_error(const std::string& inside) {
  try {
    sdf(inside);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

std::string solid(const std::string& shape, const std::string& pose = "") {
  return "<collision name='c'>" + pose + "<geometry>" + shape + "</geometry></collision>";
}

TEST(Sdf, LinksJointsAndShapes) {
  const RobotModel robot = sdf(
      "<link name='a'><pose>0 0 1 0 0 0</pose>" + solid("<box><size>1 2 3</size></box>") +
      solid("<empty/>") +
      "</link>"
      "<link name='b'><pose degrees='true'>1 0 1 0 0 90</pose>" +
      solid("<mesh><uri>model://m/b.stl</uri><scale>2 2 -1</scale></mesh>",
            "<pose>0 0 0.5 0 0 0</pose>") +
      solid("<capsule><radius>0.1</radius><length>1</length></capsule>") +
      solid("<ellipsoid><radii>1 2 3</radii></ellipsoid>") +
      "<visual name='v'><geometry><ellipsoid/></geometry></visual></link>"
      "<link name='c'><pose relative_to='b'>0 2 0 0 0 0</pose></link>"
      "<joint name='j' type='revolute'><parent>a</parent><child>b</child>"
      "<axis><xyz>0 0 1</xyz><limit><lower>-1</lower><upper>2</upper></limit></axis></joint>"
      "<joint name='k' type='revolute'><pose>0 -1 0 0 0 0</pose><parent>b</parent><child>c</child>"
      "<axis><xyz expressed_in='__model__'>1 0 0</xyz>"
      "<mimic joint='j'><multiplier>2</multiplier><offset>0.5</offset></mimic></axis></joint>"
      "<joint name='w' type='fixed'><parent>world</parent><child>a</child></joint>");
  ASSERT_EQ(robot.links.size(), 5u);  // k's frame and the world
  EXPECT_FALSE(robot.is_urdf);
  EXPECT_TRUE(std::get<LinkBox>(robot.links[0].collision.at(0).shape)
                  .half_extents.isApprox(Vector3d(0.5, 1, 1.5)));
  EXPECT_EQ(robot.links[0].collision.size(), 1u);
  const PlacedLinkShape& mesh = robot.links[1].collision.at(0);
  EXPECT_EQ(std::get<LinkMesh>(mesh.shape).file, "model://m/b.stl");
  EXPECT_TRUE(std::get<LinkMesh>(mesh.shape).scale.isApprox(Vector3d(2, 2, -1)));
  EXPECT_TRUE(mesh.translation.isApprox(Vector3d(0, 0, 0.5)));
  EXPECT_EQ(std::get<LinkCapsule>(robot.links[1].collision.at(1).shape).half_height, 0.5);
  EXPECT_EQ(std::get<LinkEllipsoid>(robot.links[1].collision.at(2).shape).radii, Vector3d(1, 2, 3));
  EXPECT_TRUE(std::holds_alternative<LinkFault>(robot.links[1].visual.at(0).shape));
  EXPECT_EQ(robot.joints[0].lower, -1);
  EXPECT_EQ(robot.joints[0].upper, 2);
  EXPECT_EQ(robot.links[robot.order[0]].name, "world");

  // At rest all links are where the file places them.
  Positions positions(robot.joints.size(), 0);
  positions[0] = -0.25;  // then k is at 0
  auto frames = link_frames(robot, positions);
  positions[0] = 0;
  const auto rest = link_frames(robot, positions);
  EXPECT_TRUE(rest[1].translation().isApprox(Vector3d(1, 0, 1)));
  const Eigen::Isometry3d c_in_b = frames[1].inverse() * frames[2];
  EXPECT_TRUE(c_in_b.translation().isApprox(Vector3d(0, 2, 0))) << c_in_b.translation();
  // k turns c about the model's x, which is b's −y, through b's (0, 1, 0).
  const Eigen::Isometry3d turned = rest[1].inverse() * rest[2];
  EXPECT_TRUE(turned.translation().isApprox(Vector3d(0, 2, 0)));
  EXPECT_TRUE(
      turned.linear().isApprox(Eigen::AngleAxisd(0.5, -Vector3d::UnitY()).toRotationMatrix()));
}

TEST(Sdf, JointsThatAreTakenAsFixedAreMarked) {
  const auto marked = [](const std::string& type, const std::string& limit) {
    const RobotModel robot = sdf("<link name='a'/><link name='b'/><joint name='j' type='" + type +
                                 "'><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz>" +
                                 limit + "</axis></joint>");
    return robot.joints.at(0).taken_as_fixed;
  };
  const std::string limit = "<limit><lower>-1</lower><upper>1</upper></limit>";
  for (const char* const type : {"ball", "universal", "revolute2", "screw", "gearbox"})
    EXPECT_TRUE(marked(type, limit)) << type;
  EXPECT_TRUE(marked("prismatic", ""));
  for (const char* const type : {"prismatic", "revolute", "fixed"})
    EXPECT_FALSE(marked(type, limit)) << type;
}

TEST(Sdf, MistakesAreToldWithTheirLines) {
  const auto expect = [](const std::string& inside, const std::string& message) {
    EXPECT_NE(sdf_error(inside).find(message), std::string::npos) << sdf_error(inside);
  };
  const std::string two = "<link name='a'/><link name='b'/>";
  const RobotModel plane = sdf("<link name='a'>" + solid("<plane/>") + "</link>");
  const LinkFault fault = std::get<LinkFault>(plane.links.at(0).collision.at(0).shape);
  EXPECT_NE(fault.what.find("<plane>: is not read. Use mesh, box"), std::string::npos)
      << fault.what;
  const auto joint = [](const std::string& inside) {
    return "<joint name='j' type='revolute'><parent>a</parent><child>b</child>" + inside +
           "</joint>";
  };
  expect(two, "2 links without a parent");
  expect("", "no <link>");
  expect("<include><uri>model://x</uri></include>", "is not read");
  expect("<link name='a'/><link name='a'/>", "duplicates the link");
  expect(two + joint(""), "has no <axis>");
  expect(two + joint("<axis><xyz>0 0 0</xyz></axis>"), "length 0");
  expect(two + joint("<axis><xyz>0 0 z</xyz></axis>"), "\"z\" is not a finite number");
  expect(two + joint("<axis><xyz>0 1</xyz></axis>"), "has 2 numbers, not 3");
  expect(two + joint("<axis><xyz>0 0 1</xyz><mimic joint='x'/></axis>"),
         "no joint is called \"x\"");
  expect("<link name='a'/>" + joint(""), "its child \"b\" is not a link");
  expect("<link name='a'><pose relative_to='f'>0 0 0 0 0 0</pose></link><link name='b'/>" +
             joint("<axis><xyz>0 0 1</xyz></axis>"),
         "relative to \"f\"");
  expect("<link name='a'>\n<collision name='c'/></link>", "line 2");
  const std::string loop =
      "<joint name='k' type='fixed'><parent>a</parent><child>b</child></joint>";
  expect(two + joint("<axis><xyz>0 0 1</xyz></axis>") + loop,
         "\"b\" is the child of the joints \"j\" and \"k\". A robot is a tree: remove the one");
}

}  // namespace
}  // namespace ist::testing
