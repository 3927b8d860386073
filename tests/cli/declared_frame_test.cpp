#include <nlohmann/json.hpp>

#include "cli/program.h"
#include "support/shared_data.h"

// A mesh file's declared axes and unit are reported by the bake, and not applied.

namespace {

using ist::testing::CommandLine;
using ist::testing::Outcome;

class DeclaredFrame : public CommandLine {
 protected:
  Outcome bake(const std::string& mesh, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"bake", mesh, "-o", "new.ist", "--spheres", "5"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return ist(arguments);
  }
};

/// A tetrahedron with distinguishable axes: 1 × 2 × 3.
std::string collada(const std::string& asset) {
  return "<COLLADA version=\"1.4.1\"><asset>" + asset +
         "</asset><library_geometries><geometry id='g'><mesh><source id='p'>"
         "<float_array id='a' count='12'>0 0 0 1 0 0 0 2 0 0 0 3</float_array>"
         "<technique_common><accessor source='#a' count='4' stride='3'/></technique_common>"
         "</source><vertices id='v'><input semantic='POSITION' source='#p'/></vertices>"
         "<triangles count='4'><input semantic='VERTEX' source='#v' offset='0'/>"
         "<p>0 2 1 0 1 3 1 2 3 0 3 2</p></triangles></mesh></geometry></library_geometries>"
         "<library_visual_scenes><visual_scene id='s'><node><instance_geometry url='#g'/></node>"
         "</visual_scene></library_visual_scenes></COLLADA>";
}

TEST_F(DeclaredFrame, TheBakeSaysWhatTheFileDeclares) {
  write("z.dae", collada("<unit meter='0.001'/><up_axis>Z_UP</up_axis>"));
  const Outcome text = bake("z.dae");
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_NE(text.out.find(
                "Z up: axes are not converted; 1 unit = 0.001 m: lengths are converted to metres"),
            std::string::npos)
      << text.out;
  const nlohmann::json z = nlohmann::json::parse(bake("z.dae", {"--json"}).out);
  EXPECT_EQ(z.at("declared").at("up_axis"), "Z");
  EXPECT_EQ(z.at("declared").at("unit"), 0.001);
  EXPECT_NEAR(z.at("volume"), 1e-9, 1e-15);

  write("y.dae", collada("<up_axis>Y_UP</up_axis>"));
  const nlohmann::json y = nlohmann::json::parse(bake("y.dae", {"--json"}).out);
  EXPECT_EQ(y.at("declared").at("up_axis"), "Y");
  EXPECT_TRUE(y.at("declared").at("unit").is_null());
  const nlohmann::json none = nlohmann::json::parse(bake("cube.obj", {"--json"}).out);
  EXPECT_TRUE(none.at("declared").at("up_axis").is_null());
}

/// A robot's link: its visual DAE over its collision STL, both at the link's origin.
TEST_F(DeclaredFrame, ARobotsVisualAndCollisionMeshesCoincide) {
  IST_NEEDS_SHARED("meshes/dev/robots");
  const auto file = [](const std::string& name) {
    return ist::testing::shared_path("meshes/dev/robots/ur_description/meshes/ur5/" + name)
        .string();
  };
  const std::vector<std::pair<std::string, std::string>> bakes = {
      {file("visual/forearm.dae"), "visual.ist"}, {file("collision/forearm.stl"), "collision.ist"}};
  for (const auto& [mesh, asset] : bakes)
    ASSERT_EQ(ist({"bake", mesh, "-o", asset, "--spheres", "500", "--quiet"}).exit_code, 0);
  const Outcome outcome =
      ist({"query", "visual.ist", "collision.ist", "--pose", "1,0,0,0,0,0,0", "--json"});
  const double volume = nlohmann::json::parse(ist({"info", "visual.ist", "--json"}).out)["volume"];
  EXPECT_GT(nlohmann::json::parse(outcome.out)[0].at("volume"), 0.9 * volume);
}

}  // namespace
