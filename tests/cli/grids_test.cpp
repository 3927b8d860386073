#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/program.h"

namespace {

using ist::testing::CommandLine;
using ist::testing::Outcome;

class GridCommands : public CommandLine {};

TEST_F(GridCommands, EveryGridBakesAnAssetThatChecks) {
  for (const std::string grid : {"banded", "uniform", "explicit", "implicit", "hybrid"}) {
    std::vector<std::string> arguments = {"bake", "cube.obj", "-o", grid + ".ist", "--spheres",
                                          "60",   "--grid",   grid, "--quiet"};
    if (grid != "banded" && grid != "explicit")
      arguments.insert(arguments.end(), {"--grid-resolution", "16"});
    const Outcome bake = ist(arguments);
    EXPECT_EQ(bake.exit_code, 0) << grid << ": " << bake.err;
    const Outcome check = ist({"check", grid + ".ist", "--mesh", "cube.obj"});
    EXPECT_EQ(check.exit_code, 0) << grid << ": " << check.out << check.err;
  }
  // Grids differ in speed where they place prototypes alike.
  EXPECT_NE(read("uniform.ist"), read("hybrid.ist"));
}

TEST_F(GridCommands, GridOptionsAreTakenAndChecked) {
  EXPECT_EQ(ist({"bake", "cube.obj", "-o", "a.ist", "--spheres", "20", "--grid", "hybrid",
                 "--grid-start", "3", "--grid-refinements", "1", "--grid-rounds", "1", "--quiet"})
                .exit_code,
            0);
  const Outcome large = ist({"bake", "cube.obj", "-o", "b.ist", "--grid", "explicit",
                             "--grid-start", "512", "--grid-refinements", "4", "--quiet"});
  EXPECT_EQ(large.exit_code, 1);
  EXPECT_NE(large.err.find("grid"), std::string::npos) << large.err;
  EXPECT_EQ(ist({"bake", "cube.obj", "-o", "b.ist", "--grid", "quadtree"}).exit_code, 2);
}

/// They would change nothing but the hash of the asset.
TEST_F(GridCommands, OptionsThatTheGridHasNoUseForAreRefused) {
  const auto bake = [&](const std::string& grid, std::vector<std::string> options) {
    options.insert(options.begin(),
                   {"bake", "cube.obj", "-o", "a.ist", "--spheres", "5", "--grid", grid});
    return ist(options);
  };
  const auto expect_refused = [&](const std::string& grid, const std::string& option,
                                  const std::string& value) {
    const Outcome outcome = bake(grid, {option, value});
    EXPECT_EQ(outcome.exit_code, 2) << grid << " " << option;
    EXPECT_NE(outcome.err.find(option + ": has no effect with --grid " + grid), std::string::npos)
        << outcome.err;
    EXPECT_FALSE(exists("a.ist"));
  };
  for (const char* option :
       {"--grid-resolution", "--grid-start", "--grid-refinements", "--grid-rounds"})
    expect_refused("banded", option, "2");
  expect_refused("uniform", "--grid-refinements", "2");
  expect_refused("uniform", "--grid-rounds", "2");
  expect_refused("explicit", "--grid-resolution", "16");
  for (const char* grid : {"uniform", "explicit", "implicit", "hybrid"})
    expect_refused(grid, "--epsilon", "0.1");
  EXPECT_EQ(bake("uniform", {"--grid-start", "4", "--grid-resolution", "16"}).exit_code, 2);
  // Automatic values may be given explicitly, and settings in use have an effect.
  EXPECT_EQ(bake("banded", {"--grid-resolution", "0", "--grid-refinements", "-1"}).exit_code, 0);
  for (const char* grid : {"implicit", "hybrid"})
    EXPECT_EQ(bake(grid, {"--grid-start", "4", "--grid-resolution", "16", "--grid-refinements", "1",
                          "--grid-rounds", "3"})
                  .exit_code,
              0);
}

/// Only the banded packing is greedy and knows by how much.
TEST_F(GridCommands, NoPromiseIsPrintedWhereNoneIsKept) {
  for (const std::string grid : {"uniform", "explicit", "implicit", "hybrid"}) {
    std::vector<std::string> arguments = {"bake",      "cube.obj", "-o",     "g.ist",
                                          "--spheres", "10",       "--grid", grid};
    if (grid != "explicit") arguments.insert(arguments.end(), {"--grid-resolution", "16"});
    const Outcome bake = ist(arguments);
    EXPECT_EQ(bake.out.find("at least"), std::string::npos) << bake.out;
    EXPECT_NE(bake.out.find("no bound: grid " + grid), std::string::npos) << bake.out;
    const auto json = nlohmann::json::parse(ist({"info", "g.ist", "--json"}).out);
    EXPECT_TRUE(json.at("kept_ratio_worst").is_null()) << grid;
    EXPECT_TRUE(json.at("kept_ratio_median").is_null()) << grid;
  }
  EXPECT_NE(ist({"info", "cube.ist"}).out.find("radius at least"), std::string::npos);
  EXPECT_GT(nlohmann::json::parse(ist({"info", "cube.ist", "--json"}).out).at("kept_ratio_worst"),
            0.5);
}

TEST_F(GridCommands, MedialWritesPointsInsideTheMesh) {
  ASSERT_EQ(ist({"sample", "gear", "-o", "gear.obj"}).exit_code, 0);
  const Outcome outcome = ist({"medial", "gear.obj", "-o", "nodes.csv", "--resolution", "24"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  std::istringstream table(read("nodes.csv"));
  std::string line;
  std::getline(table, line);
  EXPECT_EQ(line, "x,y,z,r");
  std::size_t rows = 0;
  while (std::getline(table, line)) {
    double x = 0, y = 0, z = 0, r = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf", &x, &y, &z, &r), 4) << line;
    EXPECT_GT(r, 0);
    EXPECT_LE(r, 5);  // the gear is 10 across
    ++rows;
  }
  EXPECT_GT(rows, 50u);
  EXPECT_EQ(ist({"medial", "cube.obj", "-o", "cube.obj"}).exit_code, 1);
  EXPECT_EQ(ist({"medial", "cube.obj"}).exit_code, 2);
}

}  // namespace
