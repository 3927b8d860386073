#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <string>

#include <ist/types.h>

#include "robots/description/kinematics.h"
#include "robots/description/robot_model.h"
#include "robots/description/self_collision.h"
#include "support/temp_file.h"

// Joints, and the planner's data about links that touch each other.

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

TEST(RobotJoints, AChainOfMimicsFollowsItsLast) {
  const auto slide = [](const char* name, const char* parent, const char* child,
                        const std::string& mimic) {
    return joint(name, "prismatic", parent, child, "<limit lower='-9' upper='9'/>" + mimic);
  };
  for (const bool reversed : {false, true}) {
    const std::string by_b = slide("c", "a", "l3", "<mimic joint='b' multiplier='3' offset='1'/>"),
                      by_a =
                          slide("b", "a", "l2", "<mimic joint='a' multiplier='-2' offset='0.5'/>");
    const RobotModel robot = robot_of(links({"a", "l1", "l2", "l3"}) + slide("a", "a", "l1", "") +
                                      (reversed ? by_b + by_a : by_a + by_b));
    const auto frames = link_frames(robot, {0.25, 0, 0});
    EXPECT_EQ(frames[2].translation().x(), 0.5 - 2 * 0.25) << reversed;
    EXPECT_EQ(frames[3].translation().x(), 1 + 3 * (0.5 - 2 * 0.25)) << reversed;
  }
  EXPECT_NE(error_of(links({"a", "l1", "l2"}) + slide("a", "a", "l1", "<mimic joint='b'/>") +
                     slide("b", "a", "l2", "<mimic joint='a'/>"))
                .find("moves on its own"),
            std::string::npos);
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
         "lower is above upper. Exchange them, or make a joint continuous that turns without");
  expect(two + joint("j", "continuous", "a", "b", "<axis xyz='0 0 0'/>"), "length 0");
  expect(two + joint("j", "continuous", "a", "b", "<mimic joint='x'/>"),
         "no joint is called \"x\"");
  expect(two + joint("j", "continuous", "a", "b", "<mimic joint='j'/>"), "moves on its own");
  expect(links({"a", "b", "c"}) + joint("j", "fixed", "a", "b") + joint("j", "fixed", "b", "c"),
         "duplicates the joint");
  expect(two + std::string("\n\0", 2), ": line 2: a byte of 0");
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

Chain chain(double radius, const std::string& limits = "<limit lower='-3' upper='3'/>") {
  Chain out;
  const std::vector<std::string> names = {"a", "b", "c", "d"};
  std::string joints;
  for (std::size_t i = 1; i < names.size(); ++i)
    joints += joint("j" + names[i], "revolute", names[i - 1], names[i],
                    at(1, 0, 0) + "<axis xyz='0 0 1'/>" + limits);
  out.robot = robot_of(links(names) + joints);
  for (const std::string& name : names)
    out.spheres.push_back({name, {{Vector3d(0.25, 0, 0), radius}, {Vector3d(0.75, 0, 0), radius}}});
  return out;
}

/// Solids that are balls of that radius in the spheres' middles.
LinksOverlap balls(const std::vector<LinkSpheres>& links, double radius) {
  return [links, radius](std::size_t a, std::size_t b, const Eigen::Isometry3d& b_in_a) {
    for (const CoverSphere& p : links[a].spheres)
      for (const CoverSphere& q : links[b].spheres)
        if ((p.centre - b_in_a * q.centre).norm() < 2 * radius) return true;
    return false;
  };
}

std::vector<std::string> names_of(const std::vector<LinkSpheres>& links) {
  std::vector<std::string> names;
  for (const LinkSpheres& link : links) names.push_back(link.link);
  return names;
}

SelfCollision study(const RobotModel& robot, const std::vector<LinkSpheres>& links, double solids,
                    const WantedPose& wanted = {}) {
  return SelfCollisionStudy(robot, names_of(links), balls(links, solids), wanted).of(links, true);
}

std::set<std::string> ignored_of(const SelfCollision& self) {
  std::set<std::string> out;
  for (const LinkPair& pair : self.pairs)
    if (!pair.ignored.empty()) out.insert(pair.a + pair.b + " " + pair.ignored);
  return out;
}

TEST(SelfCollision, IgnoresNeighboursAndPairsWhoseSolidsNeverOrAlwaysOverlap) {
  const Chain thin = chain(0.2);
  const SelfCollision self = study(thin.robot, thin.spheres, 0.15);
  EXPECT_EQ(ignored_of(self), (std::set<std::string>{"ab Adjacent", "bc Adjacent", "cd Adjacent"}));
  EXPECT_EQ(self.pairs.size(), 6u);
  EXPECT_GE(self.samples, 1000u);
  EXPECT_EQ(self.missed, 0u);
  EXPECT_GT(self.colliding, 0u);
  EXPECT_GT(self.falsely, 0u);

  // The second link has no spheres: its neighbours become neighbours.
  const std::vector<LinkSpheres> without = {thin.spheres[0], thin.spheres[2], thin.spheres[3]};
  EXPECT_EQ(ignored_of(study(thin.robot, without, 0.15)),
            (std::set<std::string>{"ac Adjacent", "cd Adjacent"}));

  // Spheres so large that links two apart overlap at any angle, around solids that never do.
  const Chain fat = chain(0.95, "<limit lower='-1' upper='1'/>");
  for (const LinkPair& pair : study(fat.robot, fat.spheres, 0.05).pairs)
    if (pair.a == "a" && pair.b == "c") {
      EXPECT_EQ(pair.ignored, "Never");
      EXPECT_GE(pair.tried, 10000u);
    }
  // The same around solids that always do.
  EXPECT_TRUE(ignored_of(study(fat.robot, fat.spheres, 0.9)).contains("ac Always"));
  // If one of them is larger than its link, this may be in fewer positions.
  const SelfCollision larger =
      SelfCollisionStudy(fat.robot, names_of(fat.spheres), balls(fat.spheres, 0.9), {}, {2})
          .of(fat.spheres, true);
  EXPECT_FALSE(ignored_of(larger).contains("ac Always"));
  EXPECT_TRUE(ignored_of(larger).contains("bd Always"));
}

TEST(SelfCollision, FalseMeetingsAreOfSpheresWhileNoSolidsOverlap) {
  const Chain thin = chain(0.2);
  const SelfCollision self = study(thin.robot, thin.spheres, 0.15);
  ASSERT_FALSE(self.meetings.empty());
  std::set<std::size_t> samples;
  for (const FalseMeeting& one : self.meetings) {
    EXPECT_NE(one.a, one.b);
    EXPECT_TRUE(balls(thin.spheres, 0.2)(one.a, one.b, one.b_in_a));
    EXPECT_FALSE(balls(thin.spheres, 0.15)(one.a, one.b, one.b_in_a));
    samples.insert(one.sample);
  }
  // About as many free poses are called colliding as in the measuring ones.
  EXPECT_GT(self.free, self.samples / 2);
  EXPECT_LT(self.free, self.samples);
  EXPECT_NEAR(static_cast<double>(samples.size()) / static_cast<double>(self.free),
              self.false_share(), 0.02);
  // Spheres that are the solids meet falsely nowhere.
  EXPECT_TRUE(study(thin.robot, thin.spheres, 0.2).meetings.empty());
}

TEST(SelfCollision, FreePosesAreDrawnWhereFewAre) {
  const Chain fat = chain(0.7);
  const SelfCollision self = study(fat.robot, fat.spheres, 0.65);
  ASSERT_LT(self.samples - self.colliding, 180u);
  EXPECT_EQ(self.free, 200u);
  std::size_t drawn = 0;
  for (const FalseMeeting& one : self.meetings) {
    EXPECT_FALSE(balls(fat.spheres, 0.65)(one.a, one.b, one.b_in_a));
    drawn += one.sample >= 2 * self.samples ? 1 : 0;
  }
  EXPECT_GT(drawn, 0u);
}

TEST(SelfCollision, NoPairIsIgnoredThatOverlapsInAFewPoses) {
  // The ends meet only where all three joints are folded almost wholly.
  const Chain rare = chain(0.4, "<limit lower='-3.14' upper='3.14'/>");
  const SelfCollision self = study(rare.robot, rare.spheres, 0.02);
  EXPECT_EQ(self.missed, 0u);
  for (const LinkPair& pair : self.pairs)
    if (pair.ignored != "Adjacent") {
      EXPECT_EQ(pair.ignored, "") << pair.a << pair.b;
    }
}

/// Balls of `a` and `c` turn about one axis and overlap where they are nearest, at 0.
struct Turning {
  RobotModel robot;
  std::vector<LinkSpheres> links;
};

Turning turning() {
  const std::string limits = "<axis xyz='0 0 1'/><limit lower='-1' upper='3'/>";
  return {robot_of(ist::testing::links({"a", "b", "c"}) + joint("j", "revolute", "a", "b", limits) +
                   joint("k", "revolute", "b", "c", limits)),
          {{"a", {{{1, 0, 0}, 0.5}}}, {"b", {{{0, 0, 5}, 0.1}}}, {"c", {{{1.2, 0, 0}, 0.5}}}}};
}

TEST(SelfCollision, TheDefaultPoseIsFree) {
  const Turning robot = turning();
  SelfCollision self = study(robot.robot, robot.links, 0.45);
  EXPECT_EQ(self.pose.from, "middle");
  EXPECT_EQ(self.pose.positions, (Positions{1, 1}));
  EXPECT_TRUE(self.pose.solids_free && self.pose.overlapping.empty());

  WantedPose wanted;
  wanted.positions[0] = 2;
  self = study(robot.robot, robot.links, 0.45, wanted);
  EXPECT_EQ(self.pose.from, "given");
  EXPECT_EQ(self.pose.positions, (Positions{2, 0}));

  // Given positions are kept, and the rest searched: they overlap with the other at 0 or the
  // middle.
  wanted.positions[0] = -0.8;
  self = study(robot.robot, robot.links, 0.45, wanted);
  EXPECT_EQ(self.pose.from, "search");
  EXPECT_EQ(self.pose.positions[0], -0.8);
  EXPECT_TRUE(self.pose.solids_free);

  wanted.states = {{"folded", {0, 0}}, {"ready", {0, 2.5}}};
  wanted.positions.clear();
  EXPECT_EQ(study(robot.robot, robot.links, 0.45, wanted).pose.from, "ready");

  // No pose is free: this is reported.
  wanted.states.clear();
  wanted.positions = {{0, 0}, {1, 0}};
  self = study(robot.robot, robot.links, 0.45, wanted);
  EXPECT_FALSE(self.pose.solids_free);
  EXPECT_EQ(self.pose.overlapping.size(), 1u);
}

TEST(SelfCollision, GrippersAreLockedOpen) {
  const RobotModel robot = robot_of(
      links({"base", "arm", "hand", "left", "right"}) + joint("j1", "revolute", "base", "arm") +
      joint("j2", "revolute", "arm", "hand", at(1, 0, 0) + "<limit lower='-1' upper='1'/>") +
      joint("l", "prismatic", "hand", "left",
            at(0, 0.01, 0) + "<axis xyz='0 1 0'/><limit lower='0' upper='0.04'/>") +
      joint("r", "prismatic", "hand", "right",
            at(0, -0.01, 0) + "<axis xyz='0 -1 0'/><limit lower='0' upper='0.04'/>"
                              "<mimic joint='l'/>"));
  std::vector<LinkSpheres> spheres;
  for (const RobotLink& link : robot.links) spheres.push_back({link.name, {{{0.1, 0, 0}, 0.005}}});
  const SelfCollision self = study(robot, spheres, 0.004);
  EXPECT_EQ(self.locked, (std::map<std::size_t, double>{{2, 0.04}}));
  EXPECT_EQ(self.pose.positions[2], 0.04);
}

TEST(GroupStates, AreReadFromAnSrdf) {
  const Turning robot = turning();
  const TempFile file(
      "r.srdf",
      "<robot name='r'><group_state name='up' group='g'><joint name='k' "
      "value='0.5'/><joint name='none' value='1'/></group_state>"
      "<group_state name='top' group='g'><joint name='k' value='3.0004'/>"
      "</group_state><group_state name='far' group='g'><joint name='k' value='3.1'/>"
      "</group_state><group_state name='other' group='g'><joint name='none' "
      "value='1'/></group_state></robot>");
  const GroupStates states = group_states(robot.robot, file.path());
  ASSERT_EQ(states.poses.size(), 2u);
  EXPECT_EQ(states.poses[0], std::pair(std::string("up"), Positions{0, 0.5}));
  EXPECT_EQ(states.poses[1], std::pair(std::string("top"), Positions{0, 3}));
  EXPECT_EQ(states.unfit, (std::set<std::string>{"far", "other"}));
}

TEST(GroupStates, PairsThatAnSrdfDisables) {
  const Turning robot = turning();
  const TempFile file("r.srdf",
                      "<robot name='r'><disable_collisions link1='c' link2='a' reason='Default'/>"
                      "<disable_collisions link1='a' link2='none'/></robot>");
  using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;
  const DisabledCollisions disabled = disabled_collisions(robot.robot, file.path());
  EXPECT_EQ(disabled.pairs, (Pairs{{2, 0}}));
  EXPECT_EQ(disabled.lacking, std::set<std::string>{"none"});
}

}  // namespace
}  // namespace ist::testing
