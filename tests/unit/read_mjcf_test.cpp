#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <string>

#include <ist/types.h>

#include "robots/description/kinematics.h"
#include "robots/description/robot_model.h"
#include "support/temp_file.h"

// Robots of MuJoCo.

namespace ist::testing {
namespace {

using Eigen::Vector3d;

RobotModel mjcf(const std::string& inside) {
  return read_robot(SourceFile{"m.xml", "<mujoco model='m'>" + inside + "</mujoco>"});
}

std::string mjcf_error(const std::string& inside) {
  try {
    mjcf(inside);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Mjcf, BodiesJointsAndGeoms) {
  const RobotModel robot = mjcf(R"(
    <compiler meshdir='assets'/>
    <default><geom contype='0' conaffinity='0'/>
      <default class='solid'><geom contype='1' conaffinity='1' size='0.1'/>
        <joint axis='0 1 0' range='-90 45'/></default></default>
    <asset><mesh file='hand.stl' scale='2 2 2'/></asset>
    <worldbody><geom type='plane' size='1 1 1'/>
      <body name='a' pos='0 0 1' childclass='solid'>
        <freejoint/>
        <geom/><geom class='main' type='box' size='1 2 3'/>
        <body name='b' pos='1 0 0' euler='0 0 90'>
          <joint name='j' pos='0 0 0.5'/><joint name='s' type='slide' range='0 0.3'/>
          <geom type='capsule' fromto='0 0 0 0 0 2'/>
          <geom type='mesh' mesh='hand'/>
          <geom type='ellipsoid' size='1 2 3'/>
          <geom type='box' mesh='hand'/>
          <geom mesh='hand'/>
        </body>
      </body>
    </worldbody>
    <contact><exclude body1='a' body2='b'/></contact>)");
  ASSERT_EQ(robot.links.size(), 4u);  // world, a, and two for b
  EXPECT_EQ(robot.links[0].name, "world");
  EXPECT_TRUE(robot.links[0].collision.empty());
  EXPECT_EQ(robot.links[1].collision.size(), 1u);
  EXPECT_EQ(std::get<LinkBall>(robot.links[1].collision[0].shape).radius, 0.1);
  // The class at the top is called main.
  ASSERT_EQ(robot.links[1].visual.size(), 1u);
  EXPECT_EQ(std::get<LinkBox>(robot.links[1].visual[0].shape).half_extents, Vector3d(1, 2, 3));
  const RobotLink& b = robot.links.back();
  EXPECT_EQ(b.name, "b");
  ASSERT_EQ(b.collision.size(), 5u);
  const auto& capsule = std::get<LinkCapsule>(b.collision[0].shape);
  EXPECT_EQ(capsule.half_height, 1);
  EXPECT_EQ(b.collision[0].translation, Vector3d(0, 0, 1));
  EXPECT_EQ(std::get<LinkMesh>(b.collision[1].shape).file, "assets/hand.stl");
  EXPECT_EQ(std::get<LinkMesh>(b.collision[1].shape).scale, Vector3d(2, 2, 2));
  EXPECT_EQ(std::get<LinkEllipsoid>(b.collision[2].shape).radii, Vector3d(1, 2, 3));
  EXPECT_NE(std::get<LinkFault>(b.collision[3].shape).what.find("m.xml: line"), std::string::npos);
  EXPECT_TRUE(std::holds_alternative<LinkFault>(b.collision[4].shape));  // a sphere by default
  EXPECT_EQ(robot.excluded.size(), 1u);

  // The hinge turns about y through (0, 0, 0.5) of b, whose frame is turned by 90 degrees.
  ASSERT_EQ(robot.joints.size(), 3u);
  EXPECT_NEAR(robot.joints[1].lower, -std::numbers::pi / 2, 1e-12);
  Positions positions(3, 0.0);
  EXPECT_TRUE(link_frames(robot, positions)[3].translation().isApprox(Vector3d(1, 0, 1)));
  positions[1] = std::numbers::pi / 4;
  const double s = 0.5 * std::sqrt(0.5);
  // In b: (0, 0, 0.5) + R_y(45°) (0, 0, −0.5) = (−s, 0, 0.5 − s); b's x is the world's y.
  EXPECT_TRUE(link_frames(robot, positions)[3].translation().isApprox(Vector3d(1, -s, 1.5 - s)));
}

TEST(Mjcf, IncludesAndEqualities) {
  const TempFile inner("inner.xml",
                       "<mujocoinclude><body name='f'><joint name='l' type='slide' axis='0 1 0' "
                       "range='0 1'/><geom size='1'/></body></mujocoinclude>");
  const RobotModel robot = read_robot(SourceFile{
      std::filesystem::path(inner.path()).parent_path() / "m.xml",
      "<mujoco><worldbody><body name='h'><include file='" +
          std::filesystem::path(inner.path()).filename().string() +
          "'/><body name='g'><joint name='r' type='slide' axis='0 1 0' range='0 1'/>"
          "<geom size='1'/></body></body></worldbody><equality><joint joint1='r' joint2='l' "
          "polycoef='0.5 -1 0 0 0'/></equality></mujoco>"});
  ASSERT_EQ(robot.links.size(), 4u);
  EXPECT_FALSE(robot.joints[2].is_free());
  EXPECT_EQ(link_frames(robot, {0, 0.25, 0})[3].translation(), Vector3d(0, 0.25, 0));
}

TEST(Mjcf, JointsOfAChainFollowItsLastFromWhereTheyStand) {
  for (const bool reversed : {false, true}) {
    const std::string first = "<joint joint1='c' joint2='b' polycoef='0.5 -1 0 0 0'/>",
                      second = "<joint joint1='b' joint2='a' polycoef='0.25 2 0 0 0'/>";
    const RobotModel robot = mjcf(
        "<worldbody><body><joint name='a' type='slide' range='-9 9' ref='1'/>"
        "<body><joint name='b' type='slide' range='-9 9' ref='2'/>"
        "<body><joint name='c' type='slide' range='-9 9' ref='4'/></body></body></body>"
        "</worldbody><equality>" +
        (reversed ? second + first : first + second) + "</equality>");
    // b − 2 = 0.25 + 2 (a − 1) and c − 4 = 0.5 − (b − 2); each slides from where it stands.
    const double a = 3, b = 2.25 + 2 * (a - 1), c = 4.5 - (b - 2);
    const auto frames = link_frames(robot, {a, 0, 0});
    EXPECT_NEAR(frames[2].translation().z(), a - 1 + b - 2, 1e-12) << reversed;
    EXPECT_NEAR(frames[3].translation().z(), a - 1 + b - 2 + c - 4, 1e-12) << reversed;
  }
}

TEST(Mjcf, FreeBodiesAreTakenAsFixed) {
  for (const char* free : {"<freejoint name='f'/>", "<joint name='f' type='free'/>"}) {
    const RobotModel robot = mjcf("<worldbody><body>" + std::string(free) + "</body></worldbody>");
    EXPECT_TRUE(robot.joints[0].taken_as_fixed);
    EXPECT_EQ(robot.joints[0].name, "f");
  }
}

// Truths by MuJoCo 4.0.0: geom_size, geom_quat, jnt_limited, and mesh vertices in the world.
TEST(Mjcf, OwnValuesReplaceThoseOfClassesAsInMuJoCo) {
  const RobotModel robot = mjcf(R"(<default><geom type='box' size='0.1 0.2 0.3'/>
    <default class='q'><geom quat='0 1 0 0'/></default>
    <default class='s'><geom euler='30 0 0' size='0.4'/></default></default>
    <worldbody><body><geom class='q' euler='0 180 0'/><geom class='s' quat='0 0 0 1'/>
      <geom size='0.5 0.6' class='s'/></body></worldbody>)");
  const auto& geoms = robot.links[1].collision;
  ASSERT_EQ(geoms.size(), 3u);
  EXPECT_LT(geoms[0].rotation.angularDistance(Eigen::Quaterniond(0, 0, 1, 0)), 1e-12);
  EXPECT_LT(geoms[1].rotation.angularDistance(Eigen::Quaterniond(0, 0, 0, 1)), 1e-12);
  EXPECT_EQ(std::get<LinkBox>(geoms[1].shape).half_extents, Vector3d(0.4, 0.2, 0.3));
  EXPECT_EQ(std::get<LinkBox>(geoms[2].shape).half_extents, Vector3d(0.5, 0.6, 0.3));
}

TEST(Mjcf, BoxesBetweenTwoPointsTurnAsInMuJoCo) {
  const RobotModel robot =
      mjcf("<worldbody><geom type='box' fromto='0 0 0 0.3 0.5 0.2' size='0.1'/></worldbody>");
  const Eigen::Quaterniond truth(0.5812, 0.6978, -0.4187, 0);
  EXPECT_LT(robot.links[0].collision[0].rotation.angularDistance(truth.normalized()), 1e-3);
}

TEST(Mjcf, MeshesAreScaledBehindTheirReference) {
  const std::string placed =
      "refpos='0.1 0.2 0.3' refquat='0.9 0.1 0.2 0.3'/></asset><worldbody><geom type='mesh' "
      "mesh='m'/></worldbody>";
  const auto read = [&](const std::string& scale) {
    return mjcf("<asset><mesh name='m' file='m.obj' scale='" + scale + "' " + placed)
        .links[0]
        .collision[0];
  };
  const Eigen::Matrix3d turn =
      Eigen::Quaterniond(0.9, 0.1, 0.2, 0.3).normalized().conjugate().toRotationMatrix();
  for (const Vector3d& scale : {Vector3d(2, 2, 2), Vector3d(2, -2, 2), Vector3d(-2, -2, -2)}) {
    const PlacedLinkShape shape = read(std::to_string(scale.x()) + " " + std::to_string(scale.y()) +
                                       " " + std::to_string(scale.z()));
    const Vector3d vertex(1, 2, 3);
    const Vector3d truth = scale.cwiseProduct(turn * (vertex - Vector3d(0.1, 0.2, 0.3)));
    EXPECT_LT((shape.rotation * std::get<LinkMesh>(shape.shape).scale.cwiseProduct(vertex) +
               shape.translation - truth)
                  .norm(),
              1e-12);
  }
  EXPECT_NE(std::get<LinkFault>(read("1 2 1").shape).what.find("differs by axis"),
            std::string::npos);
}

TEST(Mjcf, AnEmptyRangeIsNoLimit) {
  const RobotModel robot = mjcf(
      "<worldbody><body><joint name='a' range='0 0'/><joint name='b' type='slide' range='0 0'/>"
      "</body></worldbody>");
  EXPECT_EQ(robot.joints[0].upper, std::numbers::pi);
  EXPECT_TRUE(robot.joints[1].taken_as_fixed);
}

TEST(Mjcf, PathsAreStrippedAndCoefficientsFilledUp) {
  const RobotModel robot = mjcf(
      "<compiler strippath='true' meshdir='d'/><asset><mesh name='m' file='a/b.stl'/></asset>"
      "<worldbody><body><joint name='j'/><geom type='mesh' mesh='m'/><body><joint name='k'/></body>"
      "</body></worldbody><equality><joint joint1='j' joint2='k' polycoef='0.25'/></equality>");
  EXPECT_EQ(std::get<LinkMesh>(robot.links[1].collision[0].shape).file, "d/b.stl");
  EXPECT_EQ(robot.joints[0].offset, 0.25);
  EXPECT_EQ(robot.joints[0].multiplier, 1);
  EXPECT_FALSE(robot.joints[0].is_free());
}

TEST(Mjcf, FlexesAreNamed) {
  const RobotModel robot = mjcf(
      "<worldbody><body><flexcomp name='cloth'/></body></worldbody>"
      "<deformable><flex name='jelly'/></deformable>");
  EXPECT_EQ(robot.endless, (std::vector<std::string>{"jelly", "cloth"}));
}

TEST(Mjcf, NamesAreDecoded) {
  const RobotModel robot = mjcf(
      "<asset><mesh file='a&amp;b.stl'/></asset><worldbody><body name='x&lt;y'>"
      "<geom type='mesh' mesh='a&amp;b'/></body></worldbody>");
  EXPECT_EQ(robot.links[1].name, "x<y");
  EXPECT_EQ(std::get<LinkMesh>(robot.links[1].collision[0].shape).file, "a&b.stl");
}

TEST(Mjcf, ShapesKnowTheirLines) {
  const RobotModel robot = read_robot(SourceFile{
      "m.xml",
      "<mujoco>\n<asset><mesh name='m' file='a.stl'/></asset>\n<worldbody><body name='b'>\n"
      "<geom type='mesh' mesh='m'/>\n<geom size='1'/></body></worldbody></mujoco>"});
  ASSERT_EQ(robot.links[1].collision.size(), 2u);
  EXPECT_EQ(robot.links[1].collision[0].line, 4u);
  EXPECT_EQ(robot.links[1].collision[1].line, 5u);
}

TEST(Mjcf, SaysWhatIsWrongAndWhere) {
  const auto expect = [](const std::string& inside, const std::string& message) {
    EXPECT_NE(mjcf_error(inside).find(message), std::string::npos) << mjcf_error(inside);
  };
  expect("<worldbody>\n<body><joint type='screw'/></body></worldbody>",
         "m.xml: line 2: <joint>: its type \"screw\" is unknown");
  expect("<worldbody><body><joint range='2 1'/></body></worldbody>", "the smaller first");
  expect("<worldbody><body name='a'/><body name='a'/></worldbody>", "duplicates the body");
  expect("<worldbody><body name='a\nb'/></worldbody>", "control characters");
  expect("<worldbody><body quat='0 0 0 0'/></worldbody>", "not all 0");
  for (const char* turn : {"zaxis='0 0 0'", "axisangle='0 0 0 90'", "xyaxes='1 0 0 2 0 0'"})
    expect("<worldbody><body " + std::string(turn) + "/></worldbody>",
           "an axis of its rotation is 0, or both of xyaxes are parallel");
  expect("<asset><mesh name='m' file='a.stl'/><mesh name='m' file='b.stl'/></asset>",
         "duplicates the mesh \"m\"");
  expect("<worldbody><geom class='none'/></worldbody>", "its class \"none\" is not defined");
  for (const char* macro : {"<frame/>", "<composite/>"})
    expect("<worldbody>" + std::string(macro) + "</worldbody>", "mj_saveLastXML");
  expect("<compiler coordinate='global'/>", "global coordinates are not read");
  expect("<contact><exclude body1='a' body2='b'/></contact>", "\"a\" is not a body");
}

}  // namespace
}  // namespace ist::testing
