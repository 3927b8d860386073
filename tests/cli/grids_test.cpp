#include <sstream>

#include "cli/program.h"

namespace {

using ist::testing::CommandLine;
using ist::testing::Outcome;

class GridCommands : public CommandLine {};

TEST_F(GridCommands, EveryGridBakesAnAssetThatChecks) {
  for (const std::string grid : {"banded", "uniform", "explicit", "implicit", "hybrid"}) {
    const Outcome bake = ist({"bake", "cube.obj", "-o", grid + ".ist", "--spheres", "60", "--grid",
                              grid, "--grid-resolution", "16", "--quiet"});
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
