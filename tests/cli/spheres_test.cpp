#include <urdf_parser/urdf_parser.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/program.h"
#include "support/shared_data.h"

// `ist spheres` and `ist bake` of robots: what they write is read back by the readers that other
// tools use.

namespace {

using ist::testing::CommandLine;
using ist::testing::Outcome;
using Json = nlohmann::json;

class RobotCommands : public CommandLine {
 protected:
  void SetUp() override {
    CommandLine::SetUp();
    write("r.urdf", R"(<?xml version="1.0"?>
<robot name="arm">
  <link name="base_link">
    <visual><geometry><mesh filename="cube.obj"/></geometry></visual>
    <collision><origin xyz="0 0 1"/><geometry><mesh filename="cube.obj" scale="2 1 1"/></geometry></collision>
  </link>
  <link name="on">
    <collision><geometry><cylinder radius="0.2" length="1"/></geometry></collision>
  </link>
  <link name="tip"><collision><origin xyz="1 0 0"/><geometry><sphere radius="0.5"/></geometry></collision></link>
  <link name="frame"/>
  <joint name="j1" type="fixed"><parent link="base_link"/><child link="on"/></joint>
  <joint name="j2" type="fixed"><parent link="on"/><child link="tip"/></joint>
  <joint name="j3" type="fixed"><parent link="tip"/><child link="frame"/></joint>
</robot>
)");
  }

  Json spheres_json(const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"spheres", "r.urdf", "-o", "s.json", "--count", "6"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return Json::parse(read("s.json"));
  }

  void expect_error(const std::vector<std::string>& arguments, int code,
                    const std::string& message) {
    const auto before = new_files();
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << outcome.err;
    EXPECT_EQ(new_files(), before);
  }
};

void expect_same(const YAML::Node& list, const Json& spheres) {
  ASSERT_EQ(list.size(), spheres.size());
  for (std::size_t i = 0; i < list.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(list[i]["center"][k].as<double>(), spheres[i][k].get<double>());
    EXPECT_EQ(list[i]["radius"].as<double>(), spheres[i][3].get<double>());
  }
}

TEST_F(RobotCommands, EveryFormatHoldsTheSameSpheres) {
  const Json json = spheres_json();
  ASSERT_EQ(json["links"].size(), 3u);
  EXPECT_EQ(json["links"]["tip"]["spheres"], Json::parse("[[1.0,0.0,0.0,0.5]]"));
  for (const auto& [name, link] : json["links"].items()) {
    EXPECT_LE(link["spheres"].size(), 6u) << name;
    EXPECT_TRUE(link["covered"].get<bool>()) << name;
    EXPECT_GE(link["protrusion"].get<double>(), 0) << name;
  }
  for (const char* file : {"s.urdf", "s.yml", "s.xrdf", "s.srdf"})
    ASSERT_EQ(ist({"spheres", "r.urdf", "-o", file, "--count", "6"}).exit_code, 0) << file;

  const auto robot = urdf::parseURDFFile((folder_ / "s.urdf").string());
  ASSERT_NE(robot, nullptr);
  EXPECT_EQ(robot->getName(), "arm");
  EXPECT_EQ(robot->links_.size(), 4u);
  EXPECT_NE(robot->getLink("base_link")->visual, nullptr);
  for (const auto& [name, link] : json["links"].items()) {
    const auto& shapes = robot->getLink(name)->collision_array;
    ASSERT_EQ(shapes.size(), link["spheres"].size()) << name;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      const auto* const sphere = dynamic_cast<const urdf::Sphere*>(shapes[i]->geometry.get());
      ASSERT_NE(sphere, nullptr);
      EXPECT_EQ(sphere->radius, link["spheres"][i][3].get<double>());
      EXPECT_EQ(shapes[i]->origin.position.x, link["spheres"][i][0].get<double>());
      EXPECT_EQ(shapes[i]->origin.position.z, link["spheres"][i][2].get<double>());
    }
  }

  const YAML::Node curobo = YAML::LoadFile((folder_ / "s.yml").string());
  const YAML::Node xrdf = YAML::LoadFile((folder_ / "s.xrdf").string());
  EXPECT_EQ(xrdf["format"].as<std::string>(), "xrdf");
  EXPECT_EQ(xrdf["collision"]["geometry"].as<std::string>(), "arm_spheres");
  for (const auto& [name, link] : json["links"].items()) {
    expect_same(curobo["robot_cfg"]["kinematics"]["collision_spheres"][name], link["spheres"]);
    expect_same(xrdf["geometry"]["arm_spheres"]["spheres"][name], link["spheres"]);
    EXPECT_NE(read("s.srdf").find("<link_sphere_approximation link=\"" + name + "\">"),
              std::string::npos);
  }
  EXPECT_NE(read("s.srdf").find("<sphere center=\"1 0 0\" radius=\"0.5\"/>"), std::string::npos);
}

/// An arm of four links with a gripper of two fingers that move together.
constexpr const char* kArm = R"(<robot name="arm">
  <link name="base"><collision><geometry><box size="0.3 0.3 0.3"/></geometry></collision></link>
  <link name="upper"><collision><origin xyz="0.5 0 0"/><geometry><box size="0.9 0.2 0.2"/></geometry></collision></link>
  <link name="lower"><collision><origin xyz="0.5 0 0"/><geometry><box size="0.9 0.2 0.2"/></geometry></collision></link>
  <link name="hand"><collision><geometry><box size="0.1 0.3 0.1"/></geometry></collision></link>
  <link name="left"><collision><origin xyz="0.1 0 0"/><geometry><box size="0.1 0.02 0.02"/></geometry></collision></link>
  <link name="right"><collision><origin xyz="0.1 0 0"/><geometry><box size="0.1 0.02 0.02"/></geometry></collision></link>
  <joint name="j1" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.3"/><axis xyz="0 1 0"/><limit lower="0.5" upper="2.5" effort="1" velocity="1"/></joint>
  <joint name="j2" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="1 0 0"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="f" type="fixed"><parent link="lower"/><child link="hand"/><origin xyz="1 0 0"/></joint>
  <joint name="l" type="prismatic"><parent link="hand"/><child link="left"/><origin xyz="0 0.1 0"/><axis xyz="0 1 0"/><limit lower="0" upper="0.04" effort="1" velocity="1"/></joint>
  <joint name="r" type="prismatic"><parent link="hand"/><child link="right"/><origin xyz="0 -0.1 0"/><axis xyz="0 -1 0"/><limit lower="0" upper="0.04" effort="1" velocity="1"/><mimic joint="l"/></joint>
</robot>)";

TEST_F(RobotCommands, PlannersGetAWholeRobot) {
  write("arm.urdf", kArm);
  for (const char* file : {"a.yml", "a.xrdf", "a.srdf", "a.json"})
    ASSERT_EQ(ist({"spheres", "arm.urdf", "-o", file, "--count", "3"}).exit_code, 0) << file;
  const YAML::Node xrdf = YAML::LoadFile((folder_ / "a.xrdf").string());
  const YAML::Node curobo = YAML::LoadFile((folder_ / "a.yml").string())["robot_cfg"]["kinematics"];
  using Words = std::vector<std::string>;
  const Words joints = {"j1", "j2", "l"};
  EXPECT_EQ(curobo["urdf_path"].as<std::string>(), "arm.urdf");
  EXPECT_EQ(curobo["lock_joints"]["l"].as<double>(), 0.04);  // the gripper, open
  EXPECT_EQ(curobo["base_link"].as<std::string>(), "base");
  EXPECT_EQ(curobo["tool_frames"].as<Words>(), Words{"hand"});
  EXPECT_EQ(curobo["collision_link_names"].as<Words>(),
            (Words{"base", "upper", "lower", "hand", "left", "right"}));
  EXPECT_EQ(curobo["cspace"]["joint_names"].as<Words>(), joints);
  EXPECT_EQ(curobo["cspace"]["default_joint_position"].as<std::vector<double>>(),
            (std::vector<double>{1.5, 0, 0.04}));
  // The requirements of cuRobo's converter of XRDF.
  EXPECT_TRUE(xrdf["collision"]["buffer_distance"].IsMap());
  EXPECT_EQ(xrdf["self_collision"]["geometry"].as<std::string>(),
            xrdf["collision"]["geometry"].as<std::string>());
  EXPECT_EQ(xrdf["tool_frames"].as<Words>(), Words{"hand"});
  EXPECT_EQ(xrdf["cspace"]["joint_names"].as<Words>(), (Words{"j1", "j2"}));
  for (const char* limits : {"acceleration_limits", "jerk_limits"})
    EXPECT_EQ(xrdf["cspace"][limits].size(), 2u);
  EXPECT_EQ(xrdf["default_joint_positions"]["l"].as<double>(), 0.04);
  EXPECT_EQ(xrdf["default_joint_positions"]["j1"].as<double>(), 1.5);
  // All three ignore the same pairs, neighbours among them.
  const Json json = Json::parse(read("a.json"));
  std::size_t adjacent = 0;
  for (const Json& pair : json["self_collision"]["ignored"]) {
    const std::string a = pair["links"][0], b = pair["links"][1], reason = pair["reason"];
    adjacent += reason == "Adjacent" ? 1 : 0;
    for (const YAML::Node& ignore :
         {curobo["self_collision_ignore"], xrdf["self_collision"]["ignore"]}) {
      const Words others = ignore[a].as<Words>();
      EXPECT_NE(std::find(others.begin(), others.end(), b), others.end()) << a << b;
    }
    EXPECT_NE(read("a.srdf").find("<disable_collisions link1=\"" + a + "\" link2=\"" + b +
                                  "\" reason=\"" + reason + "\"/>"),
              std::string::npos);
  }
  EXPECT_EQ(adjacent, 5u);
  EXPECT_EQ(json["self_collision"]["pairs"], 15);
  for (const auto& [name, link] : json["links"].items())
    EXPECT_EQ(curobo["self_collision_buffer"][name].as<double>(), 0);
  EXPECT_EQ(json["self_collision"]["missed"], 0);
  EXPECT_TRUE(json["default_pose"]["links_free"].get<bool>());
  EXPECT_EQ(json["default_pose"]["locked"], Json::parse("[\"l\"]"));
}

TEST_F(RobotCommands, TheDefaultPoseIsAskedFor) {
  write("arm.urdf", kArm);
  write("arm.srdf",
        "<robot name='arm'><group_state name='home' group='g'><joint name='j2' value='0.5'/>"
        "</group_state></robot>");
  const auto pose = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"spheres", "arm.urdf", "-o", "p.json", "--count", "2"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return Json::parse(read("p.json"))["default_pose"];
  };
  EXPECT_EQ(pose({"--pose", "j2=1"})["positions"]["j2"], 1.0);
  const Json home = pose({"--srdf", "arm.srdf"});
  EXPECT_EQ(home["from"], "home");
  EXPECT_EQ(home["positions"]["j2"], 0.5);
  expect_error({"spheres", "arm.urdf", "-o", "o.json", "--pose", "j3=1"}, 1, "is called 'j3'");
  expect_error({"spheres", "arm.urdf", "-o", "o.json", "--pose", "j2=4"}, 1, "limits are -3 to 3");
  expect_error({"spheres", "arm.urdf", "-o", "o.json", "--pose", "r=0"}, 1, "moves freely");
  expect_error({"spheres", "arm.urdf", "-o", "o.json", "--pose", "j2"}, 2, "JOINT=NUMBER");
  expect_error({"spheres", "cube.obj", "-o", "o.json", "--pose", "j2=1"}, 2, "is not a robot");
}

/// An arm that reaches into its base at most angles: this is reported until an SRDF excludes the
/// pair.
TEST_F(RobotCommands, PairsThatMostlyCollideAreToldOrExcluded) {
  write(
      "dip.urdf",
      "<robot name='dip'><link name='base'><collision><geometry><box size='1 1 1'/></geometry>"
      "</collision></link><link name='hub'><collision><geometry><box size='0.1 0.1 0.1'/>"
      "</geometry></collision></link><link name='arm'><collision><origin xyz='0 0 0.6'/><geometry>"
      "<box size='0.2 0.2 1'/></geometry></collision></link><joint name='f' type='fixed'><parent "
      "link='base'/><child link='hub'/><origin xyz='0 0 0.55'/></joint><joint name='j' "
      "type='revolute'><parent link='hub'/><child link='arm'/><axis xyz='0 1 0'/><limit "
      "lower='1' upper='3' effort='1' velocity='1'/></joint></robot>");
  write("dip.srdf",
        "<robot name='dip'><disable_collisions link1='arm' link2='base' reason='Default'/>"
        "<disable_collisions link1='arm' link2='none'/></robot>");
  const std::vector<std::string> spheres = {"spheres", "dip.urdf", "-o", "d.json", "--count", "4"};
  Outcome outcome = ist(spheres);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("base and arm overlap in"), std::string::npos) << outcome.err;
  Json self = Json::parse(read("d.json"))["self_collision"];
  ASSERT_EQ(self["mostly_colliding"].size(), 1u);
  EXPECT_EQ(self["mostly_colliding"][0]["links"], Json::parse(R"(["base", "arm"])"));
  EXPECT_EQ(self["mostly_colliding"][0]["colliding"], self["colliding"]);
  EXPECT_GT(2 * self["colliding"].get<std::size_t>(), self["samples"].get<std::size_t>());

  std::vector<std::string> excluded = spheres;
  excluded.insert(excluded.end(), {"--srdf", "dip.srdf"});
  outcome = ist(excluded);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err.find("overlap in"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("names links that dip lacks: none"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.out.find("counts as no collision: 1, most"), std::string::npos) << outcome.out;
  const Json before = self;
  self = Json::parse(read("d.json"))["self_collision"];
  EXPECT_EQ(self["colliding"], 0);
  EXPECT_TRUE(self["mostly_colliding"].empty());
  std::size_t found = 0;
  for (const Json& pair : self["ignored"])
    if (pair["reason"] == "Excluded") {
      ++found;
      EXPECT_EQ(pair["links"], Json::parse(R"(["base", "arm"])"));
      EXPECT_EQ(pair["colliding"], before["colliding"]);  // in the same poses
    } else {
      EXPECT_TRUE(pair["colliding"].is_null());
    }
  EXPECT_EQ(found, 1u);
}

/// Repair drops the sheet; the spheres contain it all the same.
TEST_F(RobotCommands, WhatRepairDroppedIsCovered) {
  std::string cube = read("cube.obj");
  const auto corners = static_cast<int>(std::count(cube.begin(), cube.end(), 'v'));
  cube += "v 2 0 0\nv 3 0 0\nv 2 1 0\nf " + std::to_string(corners + 1) + " " +
          std::to_string(corners + 2) + " " + std::to_string(corners + 3) + "\n";
  write("fin.obj", cube);
  write("fin.urdf",
        "<robot name='r'><link name='a'><collision><geometry><mesh filename='fin.obj'/>"
        "</geometry></collision></link></robot>");
  for (const std::string input : {"fin.urdf", "fin.obj"}) {
    const Outcome outcome = ist({"spheres", input, "-o", "f.json", "--count", "8", "--repair"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const Json link = Json::parse(read("f.json"))["links"].begin().value();
    EXPECT_EQ(link["closing"]["method"], "repair");
    for (const Eigen::Vector3d& x :
         {Eigen::Vector3d(2, 0, 0), Eigen::Vector3d(3, 0, 0), Eigen::Vector3d(2.3, 0.3, 0)}) {
      bool held = false;
      for (const Json& s : link["spheres"])
        held = held || (x - Eigen::Vector3d(s[0], s[1], s[2])).norm() <= s[3].get<double>();
      EXPECT_TRUE(held) << x.transpose();
    }
    ASSERT_EQ(ist({"spheres", input, "-o", "g.json", "--capsules", "--repair"}).exit_code, 0);
    const Json whole = Json::parse(read("g.json"))["links"].begin().value();
    EXPECT_EQ(whole["covered_by"], "capsules");
    const Json& c = whole["capsules"][0];
    const Eigen::Vector3d a(c[0], c[1], c[2]), b(c[3], c[4], c[5]), x(3, 0, 0);
    const double t = std::clamp((x - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
    EXPECT_LE((x - a - t * (b - a)).norm(), c[6].get<double>());
  }
}

/// A box slides through the sheet, and beside it.
TEST_F(RobotCommands, WhatRepairDroppedCollides) {
  std::string cube = read("cube.obj");
  const auto corners = static_cast<int>(std::count(cube.begin(), cube.end(), 'v'));
  write("fin.obj", cube + "v 2 0 0\nv 3 0 0\nv 2 1 0\nf " + std::to_string(corners + 1) + " " +
                       std::to_string(corners + 2) + " " + std::to_string(corners + 3) + "\n");
  const auto box = [](const std::string& name, const std::string& geometry) {
    return "<link name='" + name + "'><collision>" + geometry + "</collision></link>";
  };
  const std::string slide = "<axis xyz='0 0 1'/><limit lower='-0.2' upper='0.2'/></joint>";
  write("pair.urdf",
        "<robot name='r'>" + box("a", "<geometry><mesh filename='fin.obj'/></geometry>") +
            box("s", "<origin xyz='0 9 0'/><geometry><sphere radius='0.1'/></geometry>") +
            box("b", "<geometry><box size='0.2 0.2 0.2'/></geometry>") +
            "<joint name='j' type='fixed'><parent link='a'/><child link='s'/><origin xyz='2.3 0.3 "
            "0'/></joint><joint name='k' type='prismatic'><parent link='s'/><child link='b'/>" +
            slide + "</robot>");
  ASSERT_EQ(ist({"spheres", "pair.urdf", "-o", "p.json", "--count", "8", "--repair"}).exit_code, 0);
  const Json self = Json::parse(read("p.json"))["self_collision"];
  // Half of the positions are within 0.1 of the sheet.
  EXPECT_NEAR(self["colliding"].get<double>() / self["samples"].get<double>(), 0.5, 0.05);
  EXPECT_EQ(self["missed"], 0);
  for (const Json& pair : self["ignored"]) EXPECT_EQ(pair["reason"], "Adjacent") << pair;
}

TEST_F(RobotCommands, WhatCannotBeClosedGetsABoundingCapsule) {
  write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  write(
      "open.urdf",
      "<robot name='r'><link name='a'><collision><geometry><mesh filename='open.obj'/></geometry>"
      "</collision></link><link name='seen'><visual><geometry><box size='1 1 1'/></geometry>"
      "</visual></link><joint name='j' type='fixed'><parent link='a'/><child link='seen'/></joint>"
      "</robot>");
  const Outcome outcome = ist({"spheres", "open.urdf", "-o", "o.json", "--repair"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("a bounding capsule stands for link a"), std::string::npos)
      << outcome.err;
  EXPECT_NE(outcome.err.find("visual shapes alone: seen; --visual"), std::string::npos);
  const Json json = Json::parse(read("o.json"));
  EXPECT_EQ(json["left_out"], Json::parse("[\"seen\"]"));
  EXPECT_EQ(json["links"]["a"]["closing"]["method"], "capsule");
  EXPECT_TRUE(json["links"]["a"]["protrusion"].is_null());
}

TEST_F(RobotCommands, JointsThatAreTakenAsFixedAreNamed) {
  const std::string box =
      "<collision name='c'><geometry><box><size>1 1 1</size></box></geometry>"
      "</collision></link>";
  write("two.sdf",
        "<sdf version='1.9'><model name='m'><link name='a'>" + box + "<link name='b'>" + box +
            "<link name='c'>" + box +
            "<joint name='u' type='universal'><parent>a</parent><child>b</child></joint>"
            "<joint name='s' type='prismatic'><parent>b</parent><child>c</child><axis><xyz>0 0 1"
            "</xyz></axis></joint></model></sdf>");
  const Outcome outcome = ist({"spheres", "two.sdf", "-o", "t.json", "--count", "2"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("taken as fixed"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find(": u, s; "), std::string::npos) << outcome.err;
  EXPECT_EQ(Json::parse(read("t.json"))["taken_as_fixed"], Json::parse("[\"u\", \"s\"]"));

  // A free joint alone carries the robot; beside others it carries a thing.
  const std::string free = "<body pos='0 0 3'><freejoint name='f'/><geom size='1'/></body>";
  write("robot.xml", "<mujoco><worldbody>" + free + "</worldbody></mujoco>");
  write("thing.xml",
        "<mujoco><worldbody>" + free + "<body><geom size='1'/></body></worldbody></mujoco>");
  for (const auto& [file, names] :
       {std::pair("robot.xml", "[]"), std::pair("thing.xml", "[\"f\"]")}) {
    ASSERT_EQ(ist({"spheres", file, "-o", "t.json"}).exit_code, 0);
    EXPECT_EQ(Json::parse(read("t.json"))["taken_as_fixed"], Json::parse(names)) << file;
  }
}

TEST_F(RobotCommands, CountsOfTheRobotAndOfLinks) {
  write("arm.urdf", kArm);
  const auto links = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"spheres", "arm.urdf", "-o", "a.json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return Json::parse(read("a.json"))["links"];
  };
  const auto total = [](const Json& links) {
    std::size_t count = 0;
    for (const Json& link : links) count += link["spheres"].size();
    return count;
  };
  const Json by_default = links({});
  EXPECT_LE(total(by_default), 48u);
  EXPECT_GT(by_default["upper"]["spheres"].size(), by_default["left"]["spheres"].size());
  const Json own = links({"--total", "20", "--count", "upper=3", "--skip", "base"});
  EXPECT_LE(total(own), 20u);
  EXPECT_EQ(own["upper"]["spheres"].size(), 3u);
  EXPECT_FALSE(own.contains("base"));
  EXPECT_EQ(links({"--count", "4", "--count", "hand=2"})["hand"]["spheres"].size(), 2u);
  EXPECT_EQ(links({"--count", "2", "--inner"})["upper"]["spheres"].size(), 2u);
  expect_error({"spheres", "arm.urdf", "-o", "o.json", "--total", "5"}, 1, "Increase it");
  // Spheres of the robot's own description count too.
  const auto link = [](const char* name, const char* shape) {
    return std::string("<link name='") + name + "'><collision><geometry>" + shape +
           "</geometry></collision></link>";
  };
  const std::string ball = "<sphere radius='.1'/>";
  write("arm.urdf", "<robot name='r'>" + link("a", "<box size='1 1 1'/>") +
                        link("b", ball.c_str()) + link("c", ball.c_str()) +
                        "<joint name='j' type='fixed'><parent link='a'/><child link='b'/></joint>"
                        "<joint name='k' type='fixed'><parent link='a'/><child link='c'/></joint>"
                        "</robot>");
  EXPECT_EQ(total(links({"--total", "6"})), 6u);
  expect_error({"spheres", "arm.urdf", "-o", "o.json", "--total", "2"}, 1, "has 2 spheres of its");
  write("arm.urdf", kArm);
  expect_error({"spheres", "arm.urdf", "-o", "o.json", "--total", "9", "--count", "1"}, 2,
               "excludes --total");
  expect_error({"spheres", "arm.urdf", "-o", "o.json", "--count", "uper=2"}, 1,
               "did you mean 'upper'?");
  expect_error({"spheres", "arm.urdf", "-o", "o.json", "--skip", "uper"}, 1,
               "did you mean 'upper'?");
  expect_error({"spheres", "cube.obj", "-o", "o.json", "--skip", "a"}, 2, "is not a robot");
}

TEST_F(RobotCommands, AllOpenLinksAreReportedAtOnce) {
  write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const std::string mesh =
      "<collision><geometry><mesh filename='open.obj'/></geometry></collision></link>";
  write("two.urdf", "<robot name='r'><link name='first'>" + mesh + "<link name='second'>" + mesh +
                        "<link name='third'><collision><geometry><box size='1 1 1'/></geometry>"
                        "</collision></link>"
                        "<joint name='a' type='fixed'><parent link='first'/><child link='second'/>"
                        "</joint><joint name='b' type='fixed'><parent link='second'/>"
                        "<child link='third'/></joint></robot>");
  for (const char* command : {"spheres", "bake"}) {
    expect_error({command, "two.urdf", "-o", "o.json"}, 1, "link first");
    expect_error({command, "two.urdf", "-o", "o.json"}, 1, "link second");
    expect_error({command, "two.urdf", "-o", "o.json"}, 1, "2 links failed");
    ASSERT_EQ(ist({command, "two.urdf", "-o", std::string(command) + ".json", "--skip", "first",
                   "--skip", "second"})
                  .exit_code,
              0);
  }
  // One of them is repaired, the other still a fault.
  const Outcome one = ist({"spheres", "two.urdf", "-o", "o.json", "--repair-link", "first"});
  EXPECT_EQ(one.exit_code, 1);
  EXPECT_EQ(one.err.find("error: two.urdf: link first"), std::string::npos) << one.err;
  EXPECT_NE(one.err.find("error: two.urdf: link second"), std::string::npos) << one.err;
  const Outcome both = ist({"spheres", "two.urdf", "-o", "o.json", "--repair-link", "first",
                            "--repair-link", "second", "--count", "2"});
  EXPECT_EQ(both.exit_code, 0) << both.err;
  expect_error({"spheres", "two.urdf", "-o", "o.json", "--repair-link", "frst"}, 1,
               "did you mean 'first'");
  expect_error({"spheres", "cube.obj", "-o", "o.json", "--repair-link", "a"}, 2, "is not a robot");
  expect_error({"spheres", "r.urdf.xacro", "-o", "o.json"}, 1, "xacro r.urdf.xacro -o");
}

/// An arm that turns close above its base: spheres that are as coarse there as elsewhere call every
/// pose colliding.
TEST_F(RobotCommands, SpheresAreFineWhereLinksPassClose) {
  write("near.urdf",
        "<robot name='near'><link name='base'><collision><geometry><box size='0.6 0.4 0.2'/>"
        "</geometry></collision></link><link name='mid'><collision><geometry><sphere "
        "radius='0.02'/></geometry></collision></link><link name='arm'><collision><origin xyz='0.4 "
        "0 0'/><geometry><box size='1 0.2 0.2'/></geometry></collision></link>"
        "<joint name='j' type='revolute'><parent link='base'/><child link='mid'/><origin xyz='0 0 "
        "0.33'/><axis xyz='0 0 1'/><limit lower='-3' upper='3'/></joint>"
        "<joint name='k' type='revolute'><parent link='mid'/><child link='arm'/><axis xyz='0 1 0'/>"
        "<limit lower='-0.9' upper='0.4'/></joint></robot>");
  const auto made = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"spheres", "near.urdf", "-o", "n.json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return Json::parse(read("n.json"));
  };
  const auto share = [](const Json& self) {
    return self["false"].get<double>() /
           (self["samples"].get<double>() - self["colliding"].get<double>());
  };
  EXPECT_GT(share(made({"--count", "8"})["self_collision"]), 0.5);
  const Json fine = made({});
  EXPECT_LT(share(fine["self_collision"]), 0.2);
  EXPECT_EQ(fine["self_collision"]["missed"], 0);
  std::size_t count = 0;
  for (const Json& link : fine["links"]) {
    count += link["spheres"].size();
    EXPECT_TRUE(link["covered"].get<bool>());
  }
  EXPECT_LE(count, 96u);
  // Even a false meeting in every pose takes no more memory.
  const Outcome coarse = ist({"spheres", "near.urdf", "-o", "n.json", "--count", "1"});
  EXPECT_EQ(coarse.exit_code, 0) << coarse.err;
  EXPECT_LT(coarse.peak_memory, 1'000'000'000u);
}

TEST_F(RobotCommands, AnSdfIsRead) {
  write(
      "r.sdf",
      "<sdf version='1.9'><model name='m'><link name='a'><collision name='c'><geometry><mesh><uri>"
      "cube.obj</uri></mesh></geometry></collision></link></model></sdf>");
  const Outcome outcome = ist({"spheres", "r.sdf", "-o", "o.json", "--count", "4"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(Json::parse(read("o.json"))["links"]["a"]["covered"].get<bool>());
  expect_error({"spheres", "r.sdf", "-o", "o.yml"}, 1, "needs the robot as a URDF");
  EXPECT_EQ(ist({"bake", "r.sdf", "-o", "baked", "--spheres", "20"}).exit_code, 0);
}

TEST_F(RobotCommands, ABakeNamesEachPrimitiveAsAField) {
  const auto link = [](const std::string& shape) {
    return "<collision><geometry>" + shape + "</geometry></collision>";
  };
  write("p.urdf", "<robot name='p'><link name='a'>" + link("<mesh filename='cube.obj'/>") +
                      link("<box size='2 4 6'/>") + link("<cylinder radius='1' length='4'/>") +
                      link("<capsule radius='1' length='3'/>") + link("<sphere radius='0.5'/>") +
                      "</link></robot>");
  const Outcome outcome = ist({"bake", "p.urdf", "-o", "p", "--spheres", "20"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json shapes = Json::parse(read("p/p.json"))["links"]["a"];
  ASSERT_EQ(shapes.size(), 5u);
  const std::vector<std::string> fields = {"box:1,2,3", "cylinder:1,2", "capsule:1,1.5",
                                           "ball:0.5"};
  for (std::size_t i = 0; i < fields.size(); ++i) {
    EXPECT_EQ(shapes[i + 1]["field"], fields[i]);
    const Outcome asked = ist({"query", fields[i], "p/a.ist", "--pose", "1,0,0,0,0,0,0"});
    EXPECT_EQ(asked.exit_code, 0) << asked.err;
  }
}

TEST_F(RobotCommands, WarningsOfAKindAreOneLine) {
  // Two cubes that overlap.
  const auto box = [](double x, int first) {
    std::string out;
    for (int i = 0; i < 8; ++i)
      out += "v " + std::to_string(x + (i & 1)) + " " + std::to_string((i >> 1) & 1) + " " +
             std::to_string((i >> 2) & 1) + "\n";
    for (const auto& [a, b, c] : std::vector<std::array<int, 3>>{{0, 2, 3},
                                                                 {0, 3, 1},
                                                                 {4, 5, 7},
                                                                 {4, 7, 6},
                                                                 {0, 1, 5},
                                                                 {0, 5, 4},
                                                                 {2, 6, 7},
                                                                 {2, 7, 3},
                                                                 {0, 4, 6},
                                                                 {0, 6, 2},
                                                                 {1, 3, 7},
                                                                 {1, 7, 5}})
      out += "f " + std::to_string(a + first) + " " + std::to_string(b + first) + " " +
             std::to_string(c + first) + "\n";
    return out;
  };
  write("two.obj", box(0, 1) + box(0.5, 9));
  const std::string mesh =
      "<collision><geometry><mesh filename='two.obj'/></geometry></collision></link>";
  write("w.urdf", "<robot name='r'><link name='first'>" + mesh + "<link name='second'>" + mesh +
                      "<joint name='a' type='fixed'><parent link='first'/><child link='second'/>"
                      "</joint></robot>");
  const Outcome outcome = ist({"spheres", "w.urdf", "-o", "w.json", "--count", "2"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_NE(outcome.err.find("links first, second: "), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find("link second"), std::string::npos) << outcome.err;
}

/// Links and spheres are placed by the joints, and are read back as meshes.
TEST_F(RobotCommands, AScene) {
  write("arm.urdf", kArm);
  ASSERT_EQ(ist({"spheres", "arm.urdf", "-o", "a.glb", "--count", "3"}).exit_code, 0);
  const std::string bytes = read("a.glb");
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data() + 12, 4);
  const Json scene = Json::parse(bytes.substr(20, length));
  const auto node = [&](const std::string& name) -> const Json& {
    for (const Json& one : scene["nodes"])
      if (one.value("name", "") == name) return one;
    throw std::runtime_error(name);
  };
  EXPECT_NEAR(node("upper")["translation"][2].get<double>(), 0.3, 1e-12);
  EXPECT_NEAR(node("hand")["translation"][0].get<double>(), 2 * std::cos(1.5), 1e-12);
  EXPECT_NEAR(node("hand")["translation"][2].get<double>(), 0.3 - 2 * std::sin(1.5), 1e-12);
  EXPECT_TRUE(node("lower mesh").contains("mesh"));
  EXPECT_GE(node("lower spheres")["children"].size(), 2u);
  EXPECT_EQ(ist({"bake", "a.glb", "-o", "scene.ist", "--spheres", "10"}).exit_code, 0);
}

TEST_F(RobotCommands, TheSameBytesAgainAndTheReportAsJson) {
  spheres_json();
  const std::string first = read("s.json");
  const Outcome outcome =
      ist({"spheres", "r.urdf", "-o", "s.json", "--count", "6", "--json", "--threads", "1"});
  EXPECT_EQ(read("s.json"), first);
  const Json report = Json::parse(outcome.out);
  EXPECT_EQ(report["links"]["on"]["covered"], true);
  EXPECT_GE(report["links"]["on"]["seconds"].get<double>(), 0);
}

TEST_F(RobotCommands, InnerAndMatchedSpheres) {
  const Json inner = spheres_json({"--inner"}), matched = spheres_json({"--matched"});
  EXPECT_LE(inner["links"]["base_link"]["protrusion"].get<double>(), 1e-9);
  EXPECT_FALSE(inner["links"]["base_link"]["covered"].get<bool>());
  double volume = 0;
  for (const auto& s : matched["links"]["base_link"]["spheres"])
    volume += 4.18879020478639 * std::pow(s[3].get<double>(), 3);
  EXPECT_NEAR(volume, 2, 0.01);
}

/// Read like other programs: every corner of the link lies in one of its three shapes.
TEST_F(RobotCommands, CapsulesHoldTheLink) {
  ASSERT_EQ(ist({"sample", "bolt", "-o", "bolt.obj"}).exit_code, 0);
  write(
      "b.urdf",
      "<robot name='b'><link name='bolt'><collision><origin xyz='1 2 3' rpy='0.3 0.8 "
      "-1'/><geometry>"
      "<mesh filename='bolt.obj'/></geometry></collision><collision><geometry><sphere radius='2'/>"
      "</geometry></collision></link></robot>");
  for (const char* const file : {"c.urdf", "c.json"})
    ASSERT_EQ(ist({"spheres", "b.urdf", "-o", file, "--capsules"}).exit_code, 0);
  const auto robot = urdf::parseURDFFile((folder_ / "c.urdf").string());
  ASSERT_NE(robot, nullptr);
  const auto& shapes = robot->getLink("bolt")->collision_array;
  ASSERT_EQ(shapes.size(), 4u);  // the sphere of the description stays
  const Json link = Json::parse(read("c.json"))["links"]["bolt"];
  EXPECT_EQ(link["spheres"], Json::parse("[[0.0, 0.0, 0.0, 2.0]]"));
  ASSERT_EQ(link["capsules"].size(), 1u);
  EXPECT_TRUE(link["covered"].get<bool>());
  const double radius = link["capsules"][0][6].get<double>();
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(-1, Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(0.8, Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()))
                                   .toRotationMatrix();
  double furthest = 0;
  std::istringstream words(read("bolt.obj"));
  for (std::string word; words >> word;) {
    Eigen::Vector3d v;
    if (word != "v" || !(words >> v.x() >> v.y() >> v.z())) continue;
    const Eigen::Vector3d x = turn * v + Eigen::Vector3d(1, 2, 3);
    double outside = 1e300;
    for (const auto& shape : shapes) {
      const auto& p = shape->origin.position;
      const auto& q = shape->origin.rotation;
      const Eigen::Vector3d own =
          Eigen::Quaterniond(q.w, q.x, q.y, q.z).inverse() * (x - Eigen::Vector3d(p.x, p.y, p.z));
      if (const auto* ball = dynamic_cast<const urdf::Sphere*>(shape->geometry.get())) {
        outside = std::min(outside, own.norm() - ball->radius);
      } else {
        const auto& rod = dynamic_cast<const urdf::Cylinder&>(*shape->geometry);
        outside = std::min(outside, std::max(own.head<2>().norm() - rod.radius,
                                             std::abs(own.z()) - rod.length / 2));
      }
    }
    furthest = std::max(furthest, outside);
  }
  EXPECT_LT(furthest, 1e-9);
  EXPECT_GT(furthest, -1e-4 * radius);
  EXPECT_LT(radius, 9.5);  // the head's corners are 8.66 from the axis
  expect_error({"spheres", "b.urdf", "-o", "c.yml", "--capsules"}, 1, "use .urdf or .json");
  expect_error({"spheres", "b.urdf", "-o", "c.json", "--capsules", "--count", "bolt=13"}, 2,
               "13 with --capsules; at most 12");
  ASSERT_EQ(ist({"spheres", "b.urdf", "-o", "d.json", "--capsules", "--count", "3"}).exit_code, 0);
  const Json two = Json::parse(read("d.json"))["links"]["bolt"];
  EXPECT_EQ(two["capsules"].size(), 2u);  // head and shaft: a third does not help
  EXPECT_LT(two["volume_ratio"].get<double>(), 0.7 * link["volume_ratio"].get<double>());
  EXPECT_LT(two["protrusion"].get<double>(), link["protrusion"].get<double>());
}

TEST_F(RobotCommands, AMeshAlone) {
  ASSERT_EQ(ist({"spheres", "cube.obj", "-o", "c.urdf", "--count", "4"}).exit_code, 0);
  const auto robot = urdf::parseURDFFile((folder_ / "c.urdf").string());
  ASSERT_NE(robot, nullptr);
  EXPECT_EQ(robot->getLink("cube")->collision_array.size(), 4u);
}

TEST_F(RobotCommands, AsFewAsAProtrusionNeedsOrAnError) {
  // One sphere around the cube protrudes by 0.37.
  const Outcome outcome = ist({"spheres", "cube.obj", "-o", "c.json", "--max-protrusion", "0.3"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json link = Json::parse(read("c.json"))["links"]["cube"];
  EXPECT_LE(link["protrusion"].get<double>(), 0.3);
  EXPECT_TRUE(link["covered"].get<bool>());
  EXPECT_GT(link["spheres"].size(), 1u);
  expect_error({"spheres", "cube.obj", "-o", "d.json", "--max-protrusion", "0.3", "--count", "1"},
               1, "1 spheres protrude by 0.36");
}

TEST_F(RobotCommands, BakesLinkByLink) {
  const Outcome outcome = ist({"bake", "r.urdf", "-o", "out/", "--spheres", "50"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json index = Json::parse(read("out/arm.json"));
  EXPECT_EQ(index["links"]["base_link"][0]["asset"], "base_link.ist");
  EXPECT_EQ(index["links"]["on"][0]["field"], "cylinder:0.20000000000000001,0.5");
  EXPECT_EQ(index["links"]["tip"][0]["field"], "ball:0.5");
  EXPECT_EQ(index["links"]["tip"][0]["pose"], Json::parse("[1.0,0.0,0.0,0.0,1.0,0.0,0.0]"));
  const Json info = Json::parse(ist({"info", "out/base_link.ist", "--json"}).out);
  EXPECT_NEAR(info["volume"].get<double>(), 2, 1e-9);
}

TEST_F(RobotCommands, MistakesAreNamedAndNothingIsWritten) {
  write("missing.urdf",
        "<robot name='r'><link name='a'><collision><geometry><mesh filename='package://p/no.stl'/>"
        "</geometry></collision></link></robot>");
  for (const char* command : {"spheres", "bake"}) {
    expect_error({command, "missing.urdf", "-o", "o.json"}, 1, "--package p=DIR");
    expect_error({command, "missing.urdf", "-o", "o.json", "--package", "p=."}, 1, "no such file");
    expect_error({command, "r.urdf", "-o", "o.json", "--package", "p"}, 2, "NAME=DIR");
    expect_error({command, "none.urdf", "-o", "o.json"}, 1, "no such file");
  }
  write("empty.urdf", "<robot name='r'><link name='a'/></robot>");
  expect_error({"spheres", "empty.urdf", "-o", "o.json"}, 1, "no link has a collision shape");
  expect_error({"bake", "empty.urdf", "-o", "out"}, 1, "no link has a collision shape");
  expect_error({"bake", "r.urdf", "-o", "out", "--scale", "2"}, 2, "its URDF places the meshes");
  expect_error({"bake", "cube.obj", "-o", "c.ist", "--visual"}, 2, "is not a robot");
  expect_error({"spheres", "cube.obj", "-o", "c.json", "--package", "p=."}, 2, "is not a robot");
  expect_error({"spheres", "r.urdf", "-o", "o.txt"}, 1, "use .urdf, .yml");
  expect_error({"spheres", "r.urdf", "-o", "r.urdf"}, 1, "name another file");
  expect_error({"spheres", "r.urdf", "-o", "o.json", "--count", "0"}, 2, "1 to 4096");
  expect_error({"spheres", "r.urdf", "-o", "o.json", "--count", "99999999999999"}, 2, "1 to 4096");
  expect_error({"spheres", "r.urdf", "-o", "o.json", "--max-protrusion", "0"}, 2,
               "--max-protrusion");
  expect_error({"spheres", "r.urdf", "-o", "o.json", "--inner", "--matched"}, 2, "excludes");
}

TEST_F(RobotCommands, HostileFilesAreRefused) {
  IST_NEEDS_SHARED("meshes/bad/entity_bomb.urdf");
  for (const char* name : {"empty", "entity_bomb", "joint_cycle", "missing_mesh", "not_closed"}) {
    const std::string file =
        ist::testing::shared_path("meshes/bad/" + std::string(name) + ".urdf").string();
    expect_error({"spheres", file, "-o", "o.json"}, 1, file);
    expect_error({"bake", file, "-o", "out"}, 1, file);
  }
  const std::string mirrored = ist::testing::shared_path("meshes/bad/negative_scale.urdf").string();
  EXPECT_EQ(ist({"spheres", mirrored, "-o", "m.json", "--count", "8"}).exit_code, 0);
}

/// urdfdom reads the same robot as we do.
TEST_F(RobotCommands, ARealRobot) {
  const std::string urdf = "meshes/dev/robots/ur_description/urdf/ur5_robot.urdf";
  IST_NEEDS_SHARED(urdf);
  const std::string file = ist::testing::shared_path(urdf).string();
  const std::string package =
      "example-robot-data=" + ist::testing::shared_path("meshes/dev").string();
  const Outcome outcome =
      ist({"spheres", file, "-o", "ur5.urdf", "--count", "8", "--package", package});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto before = urdf::parseURDFFile(file);
  const auto after = urdf::parseURDFFile((folder_ / "ur5.urdf").string());
  ASSERT_NE(after, nullptr);
  ASSERT_EQ(after->links_.size(), before->links_.size());
  EXPECT_EQ(after->joints_.size(), before->joints_.size());
  for (const auto& [name, link] : before->links_) {
    const auto& shapes = after->getLink(name)->collision_array;
    EXPECT_EQ(shapes.empty(), link->collision_array.empty()) << name;
    for (const auto& shape : shapes) EXPECT_EQ(shape->geometry->type, urdf::Geometry::SPHERE);
  }
}

}  // namespace
