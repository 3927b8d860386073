#include <urdf_parser/urdf_parser.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <nlohmann/json.hpp>

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
    expect_same(curobo["collision_spheres"][name], link["spheres"]);
    expect_same(xrdf["geometry"]["arm_spheres"]["spheres"][name], link["spheres"]);
    EXPECT_NE(read("s.srdf").find("<link_sphere_approximation link=\"" + name + "\">"),
              std::string::npos);
  }
  EXPECT_NE(read("s.srdf").find("<sphere center=\"1 0 0\" radius=\"0.5\"/>"), std::string::npos);
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
