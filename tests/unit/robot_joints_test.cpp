#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>
#include <string>

#include <ist/error.h>

#include "robot/kinematics.h"
#include "robot/robot_model.h"
#include "robot/self_collision.h"

// Joints, and what a planner is told about links that touch each other.

namespace ist::testing {
namespace {

using Eigen::Vector3d;

RobotModel robot_of(const std::string& inside) {
  return read_robot(SourceFile{"r.urdf", "<robot name='r'>" + inside + "</robot>"});
}

std::string links(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += "<link name='" + name + "'/>";
  return out;
}

std::string joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& child,
                  const std::string& inside = "<limit lower='-1' upper='1'/>") {
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent +
         "'/><child link='" + child + "'/>" + inside + "</joint>";
}

std::string at(double x, double y, double z) {
  return "<origin xyz='" + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) +
         "'/>";
}

std::string error_of(const std::string& inside) {
  try {
    robot_of(inside);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(RobotJoints, MoveLinksAsTheirAxesSay) {
  const RobotModel robot = robot_of(
      links({"a", "b", "c", "d"}) +
      joint("turn", "continuous", "a", "b", at(1, 0, 0) + "<axis xyz='0 0 2'/>") +
      joint("slide", "prismatic", "b", "c",
            at(1, 0, 0) + "<axis xyz='1 0 0'/><limit lower='0.5' upper='1.5'/>") +
      joint("follow", "revolute", "c", "d",
            "<origin rpy='0 1.5707963267948966 0'/><axis xyz='0 0 1'/><limit lower='-9' upper='9'/>"
            "<mimic joint='turn' multiplier='-2' offset='0.25'/>"));
  EXPECT_EQ(default_positions(robot)[0], 0);
  EXPECT_EQ(default_positions(robot)[1], 1);
  EXPECT_FALSE(robot.joints[2].is_free());
  const double quarter = std::numbers::pi / 2;
  const auto frames = link_frames(robot, {quarter, 2, 0});
  EXPECT_TRUE(frames[1].translation().isApprox(Vector3d(1, 0, 0)));
  EXPECT_TRUE(frames[2].translation().isApprox(Vector3d(1, 3, 0)));
  const Eigen::Matrix3d expected = (Eigen::AngleAxisd(quarter, Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(quarter, Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(0.25 - 2 * quarter, Vector3d::UnitZ()))
                                       .toRotationMatrix();
  EXPECT_TRUE(frames[3].linear().isApprox(expected));
}

TEST(RobotJoints, SayWhatIsWrong) {
  const auto expect = [](const std::string& inside, const std::string& message) {
    EXPECT_NE(error_of(inside).find(message), std::string::npos) << error_of(inside);
  };
  const std::string two = links({"a", "b"});
  expect(two + joint("j", "hinge", "a", "b"), "its type \"hinge\" is unknown");
  expect(two + joint("j", "revolute", "a", "b", ""), "has no <limit>");
  expect(two + joint("j", "revolute", "a", "b", "<limit lower='1' upper='0'/>"),
         "lower is above upper");
  expect(two + joint("j", "continuous", "a", "b", "<axis xyz='0 0 0'/>"), "length 0");
  expect(two + joint("j", "continuous", "a", "b", "<mimic joint='x'/>"), "\"x\" is not a joint");
  expect(two + joint("j", "continuous", "a", "b", "<mimic joint='j'/>"), "moves on its own");
  expect(links({"a", "b", "c"}) + joint("j", "fixed", "a", "b") + joint("j", "fixed", "b", "c"),
         "duplicates the joint");
  expect("<xacro:include filename='x'/><link name='a'/>", "xacro IN.xacro -o OUT.urdf");
}

std::vector<std::string> tools_of(const RobotModel& robot) {
  std::vector<std::string> names;
  for (const std::size_t link : tool_links(robot)) names.push_back(robot.links[link].name);
  return names;
}

TEST(RobotJoints, ToolsAreTheEndsOfLimbsAndHands) {
  const std::string arm =
      links({"base", "upper", "lower", "flange", "tool"}) +
      joint("j1", "revolute", "base", "upper") + joint("j2", "revolute", "upper", "lower") +
      joint("f1", "fixed", "lower", "flange") + joint("f2", "fixed", "flange", "tool");
  EXPECT_EQ(tools_of(robot_of(arm)), std::vector<std::string>{"tool"});
  const std::string fingers = links({"left", "right"}) + joint("l", "prismatic", "tool", "left") +
                              joint("r", "prismatic", "tool", "right");
  EXPECT_EQ(tools_of(robot_of(arm + fingers)), std::vector<std::string>{"tool"});
  EXPECT_EQ(tools_of(robot_of(links({"body", "a", "b"}) + joint("l", "revolute", "body", "a") +
                              joint("r", "revolute", "body", "b"))),
            (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(tools_of(robot_of(links({"alone"}))), std::vector<std::string>{"alone"});
}

/// A chain in the plane: each link is two balls on a unit of its x axis.
struct Chain {
  RobotModel robot;
  std::vector<LinkSpheres> spheres;
};

Chain chain(double radius, double protrusion) {
  Chain out;
  const std::vector<std::string> names = {"a", "b", "c", "d"};
  std::string joints;
  for (std::size_t i = 1; i < names.size(); ++i)
    joints += joint("j" + names[i], "revolute", names[i - 1], names[i],
                    at(1, 0, 0) + "<axis xyz='0 0 1'/><limit lower='-3' upper='3'/>");
  out.robot = robot_of(links(names) + joints);
  for (const std::string& name : names)
    out.spheres.push_back(
        {name, {{Vector3d(0.25, 0, 0), radius}, {Vector3d(0.75, 0, 0), radius}}, protrusion});
  return out;
}

std::set<std::string> ignored_of(const SelfCollision& self) {
  std::set<std::string> out;
  for (const IgnoredPair& pair : self.ignored) out.insert(pair.a + pair.b + " " + pair.reason);
  return out;
}

TEST(SelfCollision, IgnoresNeighboursAndWhatAlwaysTouches) {
  const Chain thin = chain(0.2, 0.01);
  const SelfCollision self = self_collision(thin.robot, thin.spheres);
  EXPECT_EQ(ignored_of(self), (std::set<std::string>{"ab Adjacent", "bc Adjacent", "cd Adjacent"}));
  EXPECT_TRUE(self.buffers.empty());
  EXPECT_EQ(self.pairs, 6u);
  EXPECT_GE(self.samples, 1000u);

  // The second link has no spheres: its neighbours become neighbours.
  const std::vector<LinkSpheres> without = {thin.spheres[0], thin.spheres[2], thin.spheres[3]};
  EXPECT_EQ(ignored_of(self_collision(thin.robot, without)),
            (std::set<std::string>{"ac Adjacent", "cd Adjacent"}));

  // Balls so large that links two apart overlap at any angle.
  const Chain fat = chain(0.95, 0.01);
  const auto ignored = ignored_of(self_collision(fat.robot, fat.spheres));
  EXPECT_TRUE(ignored.contains("ac Always")) << ignored.size();
  EXPECT_TRUE(ignored.contains("bd Always")) << ignored.size();
}

/// Balls of `a` and `c` turn about one axis; they are nearest, 1.5 apart, in the default pose.
SelfCollision turning_balls(double protrusion) {
  const std::string limits = "<axis xyz='0 0 1'/><limit lower='-3' upper='3'/>";
  const RobotModel robot =
      robot_of(links({"a", "b", "c"}) + joint("j", "revolute", "a", "b", limits) +
               joint("k", "revolute", "b", "c", limits));
  const std::vector<LinkSpheres> spheres = {{"a", {{{1, 0, 0}, 0.8}}, protrusion},
                                            {"b", {{{0, 0, 5}, 0.1}}, protrusion},
                                            {"c", {{{2.5, 0, 0}, 0.8}}, 2 * protrusion}};
  return self_collision(robot, spheres);
}

TEST(SelfCollision, PartsTheDefaultPoseByBuffersUpToTheProtrusion) {
  EXPECT_EQ(ignored_of(turning_balls(0.01)),
            (std::set<std::string>{"ab Adjacent", "bc Adjacent", "ac Default"}));
  const SelfCollision self = turning_balls(0.06);
  EXPECT_EQ(ignored_of(self), (std::set<std::string>{"ab Adjacent", "bc Adjacent"}));
  ASSERT_EQ(self.buffers.size(), 2u);
  EXPECT_NEAR(self.buffers.at("a"), -0.1 / 3, 1e-6);
  EXPECT_NEAR(self.buffers.at("c"), -0.2 / 3, 1e-6);
  EXPECT_LT(0.8 + self.buffers.at("a") + 0.8 + self.buffers.at("c"), 1.5);
}

}  // namespace
}  // namespace ist::testing
