#include <ist/mesh.h>

#include "cli/program.h"
#include "mesh/samples/samples.h"

namespace {

using ist::testing::CommandLine;
using ist::testing::Outcome;

class Usage : public CommandLine {};

TEST_F(Usage, HelpNamesEverySubcommandAndExitsWith0) {
  const Outcome outcome = ist({"--help"});
  EXPECT_EQ(outcome.exit_code, 0);
  for (const std::string name : {"bake", "cache", "summary", "query", "info", "check", "clash",
                                 "export", "medial", "sample", "spheres"}) {
    EXPECT_NE(outcome.out.find(name), std::string::npos) << name;
    const Outcome help = ist({name, "--help"});
    EXPECT_EQ(help.exit_code, 0) << name;
    EXPECT_NE(help.out.find("Example: ist " + name), std::string::npos) << name;
  }
  EXPECT_EQ(ist({"--version"}).exit_code, 0);
}

TEST_F(Usage, WrongUsageExitsWith2AndSaysWhy) {
  const auto expect_usage_error = [&](const std::vector<std::string>& arguments,
                                      const std::string& message) {
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << message;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_TRUE(new_files().empty());
  };
  expect_usage_error({}, "subcommand");
  expect_usage_error({"pack"}, "pack");
  expect_usage_error({"bake", "cube.obj"}, "output");
  expect_usage_error({"bake", "cube.obj", "-o", "new.ist", "--sphere", "5"}, "--sphere");
  expect_usage_error({"bake", "cube.obj", "-o", "new.ist", "--spheres", "many"},
                     "--spheres: 'many' is not a whole number");
  expect_usage_error({"bake", "cube.obj", "-o", "new.ist", "--spheres", "-5"},
                     "--spheres: '-5' is not a whole number");
  for (const std::string epsilon : {"1", "nan"})
    expect_usage_error({"bake", "cube.obj", "-o", "new.ist", "--epsilon", epsilon},
                       "--epsilon: '" + epsilon + "' is not a number from 0 to below 1");
  expect_usage_error({"bake", "cube.obj", "-o", "new.ist", "--coverage", "1.5"}, "coverage");
  expect_usage_error({"bake", "cube.obj", "-o", "new.ist", "--time", "-1"},
                     "--time: '-1' is not a finite number");
  expect_usage_error({"bake", "cube.obj", "-o", "new.ist", "--grid", "octree"}, "grid");
  expect_usage_error({"bake", "cube.obj", "-o", "new.ist", "--device", "tpu"}, "device");
  expect_usage_error({"sample", "cube"}, "output");
  // Suggests the probable intention.
  expect_usage_error({"bke", "cube.obj"}, "Did you mean 'bake'?");
  expect_usage_error({"bake", "cube.obj", "-o", "new.ist", "--sphere=5"},
                     "Did you mean '--spheres'?");
  expect_usage_error({"bake", "cube.obj", "--ouput", "new.ist"}, "Did you mean '--output'?");
}

/// Formats with doubles bring back the very mesh; STL keeps single precision and no sharing.
TEST_F(Usage, SamplesAreReadBackAsTheyAre) {
  const ist::TriangleMesh bolt = ist::make_sample("bolt");
  for (const char* name : {"bolt.obj", "bolt.ply", "bolt.off", "bolt.stl"}) {
    ASSERT_EQ(ist({"sample", "bolt", "-o", name}).exit_code, 0) << name;
    const ist::TriangleMesh back = ist::load_mesh((folder_ / name).string());
    ASSERT_EQ(back.vertices.size(), bolt.vertices.size()) << name;
    ASSERT_EQ(back.triangles.size(), bolt.triangles.size()) << name;
    const double tolerance = std::string(name) == "bolt.stl" ? 1e-6 : 0;
    for (std::size_t t = 0; t < bolt.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k)
        ASSERT_LE(
            (back.vertices[back.triangles[t][k]] - bolt.vertices[bolt.triangles[t][k]]).norm(),
            tolerance)
            << name << " triangle " << t;
  }
}

TEST_F(Usage, AnAssetHasNotTheNameOfAMesh) {
  const Outcome outcome = ist({"bake", "cube.obj", "-o", "q.obj"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("name the asset q.ist"), std::string::npos) << outcome.err;
  EXPECT_TRUE(new_files().empty());
}

TEST_F(Usage, TheClosedMeshIsWrittenWhereItIsAskedFor) {
  // A cube without its last face.
  const std::string cube = read("cube.obj");
  write("open.obj", cube.substr(0, cube.rfind("f ")));
  ASSERT_EQ(ist({"bake", "open.obj", "-o", "o.ist", "--repair", "--write-mesh", "closed.stl",
                 "--spheres", "10"})
                .exit_code,
            0);
  EXPECT_EQ(ist::close_mesh(ist::load_mesh((folder_ / "closed.stl").string()), "closed")
                .mesh.triangles.size(),
            12u);
  EXPECT_EQ(ist({"bake", "cube.obj", "-o", "p.ist", "--write-mesh", "p.xyz"}).exit_code, 2);
  EXPECT_EQ(
      ist({"bake", "open.obj", "-o", "p.ist", "--repair", "--write-mesh", "open.obj"}).exit_code,
      1);
  EXPECT_FALSE(exists("p.ist"));
}

TEST_F(Usage, JsonOfNamesThatAreNotUtf8) {
  const std::string name = "c\xff.ist";
  ASSERT_EQ(ist({"bake", "cube.obj", "-o", name, "--spheres", "5", "--json"}).exit_code, 0);
  write("bad.json", "{\"schema\": ");
  const Outcome outcome = ist({"summary", "bad.json"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.err.find("json.exception"), std::string::npos) << outcome.err;
}

TEST_F(Usage, SampleErrorsSayWhatThereIs) {
  const Outcome name = ist({"sample", "screw", "-o", "screw.obj"});
  EXPECT_EQ(name.exit_code, 1);
  EXPECT_NE(name.err.find("bolt"), std::string::npos) << name.err;
  const Outcome format = ist({"sample", "cube", "-o", "cube.xyz"});
  EXPECT_EQ(format.exit_code, 1);
  EXPECT_NE(format.err.find(".ply"), std::string::npos) << format.err;
  EXPECT_TRUE(new_files().empty());
}

}  // namespace
