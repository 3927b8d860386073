#include "library/library_folder.h"

// Robots in a manifest.

namespace ist::testing {
namespace {

using Json = nlohmann::json;

std::string urdf(const std::string& scale) {
  const auto link = [](const std::string& name, const std::string& geometry) {
    return "<link name='" + name + "'><collision><origin xyz='0 0 2' rpy='0 0.5 0'/><geometry>" +
           geometry + "</geometry></collision></link>\n";
  };
  const std::string cube = "<mesh filename='package://parts/cube.obj' scale='" + scale + "'/>";
  return "<robot name='arm 1'>" + link("base", cube) + link("same", cube) +
         link("gear", "<mesh filename='package://parts/gear.obj'/>") +
         link("ball", "<sphere radius='0.5'/>") +
         "<joint name='a' type='fixed'><parent link='base'/><child link='same'/></joint>"
         "<joint name='b' type='fixed'><parent link='base'/><child link='gear'/></joint>"
         "<joint name='c' type='fixed'><parent link='base'/><child link='ball'/></joint></robot>";
}

class Robots : public LibraryFolder {
 protected:
  void SetUp() override {
    LibraryFolder::SetUp();
    std::filesystem::create_directory(folder_ / "robots");
    write("robots/arm.urdf", urdf("1 2 -1"));
    write("robots.toml", R"([defaults]
spheres = 40

[[robot]]
urdf = "robots/arm.urdf"
packages = {parts = "meshes"}
skip = "gear"
)");
  }
};

TEST_F(Robots, BakeWhatTheRobotAloneBakes) {
  const Outcome outcome = bake("out", {}, {}, "robots.toml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  ASSERT_EQ(ist({"bake", "robots/arm.urdf", "-o", "alone", "--spheres", "40", "--package",
                 "parts=meshes", "--skip", "gear", "--device", "cpu"})
                .exit_code,
            0);
  const auto files = files_in("out"), alone = files_in("alone");
  ASSERT_EQ(files.size(), 2u);  // two links share a mesh, one is left out, one is a shape
  EXPECT_TRUE(files.at("arm_1-base.ist") == alone.at("base.ist"));
  Json index = Json::parse(files.at("arm_1.json"));
  EXPECT_EQ(index["links"]["same"][0]["asset"], "arm_1-base.ist");
  for (const char* const link : {"base", "same"}) index["links"][link][0]["asset"] = "base.ist";
  EXPECT_EQ(index, Json::parse(alone.at("arm_1.json")));
  const Json info = Json::parse(ist({"info", "out/arm_1-base.ist", "--json"}).out);
  EXPECT_NEAR(info["volume"].get<double>(), 2, 1e-9);
  EXPECT_NEAR(info["frame"]["centre"][2].get<double>(), 2, 1e-9);
}

TEST_F(Robots, AreBakedAgainWhereTheirUrdfChanged) {
  const auto status = [&] {
    const Outcome outcome = bake("out", {"--json"}, {}, "robots.toml");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return Json::parse(outcome.out).at("assets")[0].at("status").get<std::string>();
  };
  EXPECT_EQ(status(), "baked");
  EXPECT_EQ(status(), "cached");
  write("robots/arm.urdf", urdf("1 2 -1.5"));
  EXPECT_EQ(status(), "baked");
}

TEST_F(Robots, HaveNoIndexWhereAnAssetFailed) {
  write("meshes/gear.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  write("robots.toml", "[[robot]]\nurdf = 'robots/arm.urdf'\npackages.parts = 'meshes'\n");
  const Outcome outcome = bake("out", {}, {}, "robots.toml");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("gear.obj: "), std::string::npos) << outcome.err;
  EXPECT_TRUE(exists("out/arm_1-base.ist"));
  EXPECT_FALSE(exists("out/arm_1.json"));
}

TEST_F(Robots, MistakesAreToldWithTheirLines) {
  write("robots.toml", R"([[robot]]
spheres = 10
[[robot]]
urdf = "robots/none.urdf"
[[robot]]
urdf = "robots/arm.urdf"
scale = 2
visual = 1
packages = "meshes"
skip = 3
[[robot]]
urdf = "robots/arm.urdf"
[[robot]]
urdf = "robots/arm.urdf"
packages = {parts = "meshes"}
skip = ["geer"]
urd = 1
)");
  const Outcome outcome = bake("out", {}, {}, "robots.toml");
  EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
  EXPECT_FALSE(exists("out"));
  for (const char* const fault :
       {":1: a robot without a URDF", ":3: ", "none.urdf",
        ":7: scale: cannot be combined with a robot", ":8: visual: 1 is not true or false",
        ":9: packages: 'meshes' is not a table", ":10: skip: 3 is not a quoted string",
        ":11: ", "package", ":17: unknown key 'urd'", "8 mistakes"})
    EXPECT_NE(outcome.err.find(fault), std::string::npos) << fault << "\n--\n" << outcome.err;
}

}  // namespace
}  // namespace ist::testing
