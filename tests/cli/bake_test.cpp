#include <ist/gpu.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/program.h"

namespace {

using ist::testing::CommandLine;
using ist::testing::Outcome;

class BakeCommand : public CommandLine {
 protected:
  /// The bake fails with exit code 1, says `message`, and leaves nothing behind.
  void expect_error(const std::vector<std::string>& arguments, const std::string& message) {
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_TRUE(new_files().empty()) << new_files().front();
  }
};

TEST_F(BakeCommand, WritesAnAssetAndSaysWhatItHolds) {
  const Outcome outcome = ist({"bake", "cube.obj", "-o", "new.ist", "--spheres", "50"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_NE(outcome.out.find("50, "), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.err.find("CPU"), std::string::npos) << outcome.err;
  EXPECT_EQ(new_files(), std::vector<std::string>{"new.ist"});
}

TEST_F(BakeCommand, QuietSaysNothing) {
  const Outcome outcome = ist({"bake", "cube.obj", "-o", "new.ist", "--spheres", "5", "--quiet"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(outcome.err, "");
}

TEST_F(BakeCommand, JsonHoldsTheResult) {
  const Outcome outcome = ist({"bake", "cube.obj", "-o", "new.ist", "--spheres", "5", "--json"});
  const nlohmann::json json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json.at("spheres"), 5);
  EXPECT_EQ(json.at("stop"), "sphere_count");
  EXPECT_NEAR(json.at("volume"), 1, 1e-12);
  EXPECT_GT(json.at("coverage"), 0.5);
  EXPECT_GE(json.at("seconds").at("bake"), 0);
}

TEST_F(BakeCommand, TheSurfaceIsToldOfOrLeftOut) {
  const std::vector<std::string> bake = {"bake",      "cube.obj", "-o",    "new.ist",
                                         "--spheres", "5",        "--json"};
  const auto told = [&](std::vector<std::string> more) {
    more.insert(more.begin(), bake.begin(), bake.end());
    return nlohmann::json::parse(ist(more).out);
  };
  EXPECT_EQ(told({}).at("kept_mesh").at("triangles"), 12);
  const nlohmann::json none = told({"--keep-mesh", "no"});
  EXPECT_EQ(none.at("kept_mesh").at("bytes"), 0);
  EXPECT_TRUE(none.at("kept_mesh").at("error").is_null());
  EXPECT_EQ(none.at("kept_mesh").at("state"), "none");
  EXPECT_LT(none.at("bytes"), told({}).at("bytes"));
  for (const char* wrong : {"0", "0.5", "25%", "some", ""})
    EXPECT_EQ(ist({"bake", "cube.obj", "-o", "new.ist", "--keep-mesh", wrong}).exit_code, 2)
        << wrong;
}

TEST_F(BakeCommand, KeepsTheMesh) {
  const nlohmann::json json = nlohmann::json::parse(
      ist({"bake", "cube.obj", "-o", "new.ist", "--spheres", "5", "--json"}).out);
  const nlohmann::json mesh = json.at("kept_mesh");
  EXPECT_EQ(mesh.at("state"), "own");
  EXPECT_EQ(mesh.at("triangles"), 12);
  EXPECT_EQ(mesh.at("error"), 0);
  EXPECT_EQ(mesh.at("self_overlap_volume"), 0);
  EXPECT_NE(ist({"info", "new.ist"}).out.find("mesh         12 triangles, all of the mesh,"),
            std::string::npos);
  EXPECT_EQ(ist({"check", "new.ist", "--mesh", "cube.obj"}).exit_code, 0);
}

TEST_F(BakeCommand, ASurfaceAlone) {
  const Outcome baked = ist({"bake", "cube.obj", "-o", "new.ist", "--mesh-only", "--json"});
  const nlohmann::json json = nlohmann::json::parse(baked.out);
  EXPECT_EQ(json.at("spheres"), 0);
  EXPECT_EQ(json.at("kept_mesh").at("triangles"), 12);
  EXPECT_NEAR(json.at("volume"), 1, 1e-12);
  EXPECT_EQ(ist({"check", "new.ist", "--mesh", "cube.obj"}).exit_code, 0);
  EXPECT_NE(ist({"info", "new.ist"}).out.find("none: a mesh alone"), std::string::npos);
  const Outcome asked = ist({"query", "new.ist", "new.ist", "--pose", "1,0,0,0,0,0,0"});
  EXPECT_EQ(asked.exit_code, 1);
  EXPECT_NE(asked.err.find("new.ist: has no spheres"), std::string::npos) << asked.err;
  EXPECT_EQ(ist({"export", "new.ist", "-o", "-"}).exit_code, 1);
  const auto refused = [&](const std::vector<std::string>& more, const std::string& message) {
    std::vector<std::string> all = {"bake", "cube.obj", "-o", "no.ist", "--mesh-only"};
    all.insert(all.end(), more.begin(), more.end());
    const Outcome outcome = ist(all);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_NE(outcome.err.find(message), std::string::npos) << outcome.err;
  };
  refused({"--spheres", "5"}, "--spheres: has no effect with --mesh-only");
  refused({"--keep-mesh", "no"}, "--mesh-only: contradicts --keep-mesh no");
}

TEST_F(BakeCommand, SpheresTooCoarseForThinPartsAreToldOf) {
  const Outcome thin = ist({"bake", "cube.obj", "-o", "new.ist", "--spheres", "1", "--json"});
  EXPECT_EQ(nlohmann::json::parse(thin.out).at("enough_spheres"), 1);  // they are enough
  // A plate a hundred times as wide as thick: about 17,000 spheres fill half of it.
  write("plate.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 .01\nv 1 0 .01\nv 1 1 .01\nv 0 1 .01\n"
        "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  const Outcome outcome =
      ist({"bake", "plate.obj", "-o", "plate.ist", "--spheres", "200", "--json"});
  EXPECT_NE(outcome.err.find("too coarse for thin parts"), std::string::npos) << outcome.err;
  const nlohmann::json enough = nlohmann::json::parse(outcome.out).at("enough_spheres");
  EXPECT_GT(enough, 8'000);
  EXPECT_LT(enough, 40'000);
  EXPECT_NE(ist({"info", "plate.ist"}).out.find("spheres are enough"), std::string::npos);
  // Walls too thin for any number of spheres are reported too.
  const Outcome hopeless =
      ist({"bake", "plate.obj", "-o", "plate.ist", "--spheres", "200", "--scale", "1,1,0.001"});
  EXPECT_NE(hopeless.err.find("too coarse for thin parts"), std::string::npos) << hopeless.err;
  EXPECT_NE(hopeless.err.find("no number of spheres is enough"), std::string::npos);
}

TEST_F(BakeCommand, PartsOfALinkThatTouchAreToldOf) {
  write("boxes.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
        "v 0 0 2\nv 1 0 2\nv 1 1 2\nv 0 1 2\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
        "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
        "f 16 15 14 13\nf 9 10 11 12\nf 13 14 10 9\nf 14 15 11 10\nf 15 16 12 11\nf 16 13 9 12\n");
  write("r.urdf",
        "<robot name='r'><link name='a'><collision><geometry><mesh filename='boxes.obj'/>"
        "</geometry></collision></link></robot>");
  const Outcome outcome = ist({"bake", "r.urdf", "-o", "out", "--mesh-only", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string text = "link a: parts of the mesh touch";
  EXPECT_NE(outcome.err.find("r.urdf: " + text), std::string::npos) << outcome.err;
  const nlohmann::json told = nlohmann::json::parse(outcome.out).at("warnings");
  EXPECT_TRUE(std::any_of(told.begin(), told.end(), [&](const nlohmann::json& one) {
    return one.get<std::string>().starts_with(text);
  })) << told;
}

TEST_F(BakeCommand, ATargetPicksTheSphereCount) {
  const Outcome outcome = ist({"bake", "cube.obj", "-o", "new.ist", "--target-error", "20%",
                               "--at-overlap", "1%", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json json = nlohmann::json::parse(outcome.out);
  EXPECT_LT(json.at("spheres"), 1000);
  EXPECT_EQ(json.at("asked").at("error"), 0.2);
  EXPECT_EQ(json.at("asked").at("at_overlap"), 0.01);
  EXPECT_GE(json.at("predicted").at("poses"), 100);
  EXPECT_LE(json.at("predicted").at("error").at("10-50%"), 0.2);
  EXPECT_EQ(json.at("target_error"), 0.2);
  EXPECT_EQ(json.at("target_overlap"), 0.01);
  EXPECT_EQ(json.at("target_met"), true);
  EXPECT_LE(json.at("measured_error"), 0.2);
  EXPECT_EQ(outcome.err.find("warning"), std::string::npos) << outcome.err;
  EXPECT_NE(ist({"info", "new.ist"}).out.find("target 20 % at 1 % overlap: met, "),
            std::string::npos);
  for (const char* bad : {"0", "100%", "1x", "-1%"})
    EXPECT_EQ(ist({"bake", "cube.obj", "-o", "n.ist", "--target-error", bad}).exit_code, 2) << bad;
  EXPECT_EQ(ist({"bake", "cube.obj", "-o", "n.ist", "--at-overlap", "1%"}).exit_code, 2);
}

TEST_F(BakeCommand, AMissedTargetIsAWarning) {
  const Outcome outcome = ist(
      {"bake", "cube.obj", "-o", "new.ist", "--target-error", "5%", "--coverage", "0.5", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("warning"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("missed"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("coverage"), std::string::npos) << outcome.err;
  const nlohmann::json json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json.at("target_met"), false);
  EXPECT_GT(json.at("measured_error"), 0.05);
  EXPECT_EQ(json.at("search_stop"), "coverage");
  EXPECT_NE(ist({"info", "new.ist"}).out.find("missed, "), std::string::npos);
}

TEST_F(BakeCommand, CtrlCEndsASearchForATargetToo) {
  const Outcome outcome =
      ist({"bake", "cube.obj", "-o", "new.ist", "--target-error", "0.02%", "--at-overlap", "0.01%"},
          {.environment = {}, .interrupt_after = "CPU"});
  EXPECT_EQ(outcome.exit_code, 130) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_TRUE(new_files().empty()) << new_files().front();
}

TEST_F(BakeCommand, EveryLimitStopsThePacking) {
  const auto stop = [&](const std::vector<std::string>& limits) {
    std::vector<std::string> arguments = {"bake", "cube.obj", "-o", "new.ist", "--json"};
    arguments.insert(arguments.end(), limits.begin(), limits.end());
    return nlohmann::json::parse(ist(arguments).out);
  };
  EXPECT_EQ(stop({"--spheres", "9"}).at("spheres"), 9);
  const nlohmann::json coverage = stop({"--coverage", "0.6"});
  EXPECT_EQ(coverage.at("stop"), "coverage");
  EXPECT_GE(coverage.at("coverage"), 0.6);
  EXPECT_EQ(stop({"--min-radius", "0.1"}).at("stop"), "min_radius");
  EXPECT_EQ(stop({"--spheres", "0", "--time", "0.1"}).at("stop"), "time_limit");
}

TEST_F(BakeCommand, TheSameAssetForAnyNumberOfThreads) {
  for (const std::string threads : {"1", "2", "5"})
    ASSERT_EQ(ist({"bake", "capsule.obj", "-o", threads + ".ist", "--spheres", "100", "--threads",
                   threads})
                  .exit_code,
              0);
  EXPECT_EQ(read("1.ist"), read("capsule.ist"));
  EXPECT_EQ(read("2.ist"), read("capsule.ist"));
  EXPECT_EQ(read("5.ist"), read("capsule.ist"));
}

TEST_F(BakeCommand, AnOpenMeshIsRefusedUnlessRepaired) {
  write(
      "open.obj",
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
      "f 1 3 2\nf 1 4 3\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n");
  const Outcome refused = ist({"bake", "open.obj", "-o", "new.ist"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.err.find("open.obj"), std::string::npos) << refused.err;
  EXPECT_NE(refused.err.find("--repair"), std::string::npos) << refused.err;
  EXPECT_FALSE(exists("new.ist"));
  const Outcome medial = ist({"medial", "open.obj", "-o", "new.csv"});
  EXPECT_EQ(medial.exit_code, 1);
  EXPECT_NE(medial.err.find("--repair"), std::string::npos) << medial.err;

  const Outcome repaired =
      ist({"bake", "open.obj", "-o", "new.ist", "--spheres", "20", "--repair", "--json"});
  ASSERT_EQ(repaired.exit_code, 0) << repaired.err;
  EXPECT_NE(repaired.err.find("warning"), std::string::npos) << repaired.err;
  EXPECT_EQ(nlohmann::json::parse(repaired.out).at("repaired"), true);
  EXPECT_EQ(ist({"check", "new.ist", "--mesh", "open.obj"}).exit_code, 0);
  const nlohmann::json closing = nlohmann::json::parse(repaired.out).at("closing");
  EXPECT_EQ(closing.at("method"), "repair");
  EXPECT_GT(closing.at("confidence").get<double>(), 0.75);
}

TEST_F(BakeCommand, WhatRepairCannotCloseIsWrapped) {
  write("fins.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 1\nv 0 -1 -1\nf 1 2 3\nf 1 2 4\nf 1 2 5\n");
  const Outcome refused = ist({"bake", "fins.obj", "-o", "new.ist", "--repair"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.err.find("--wrap"), std::string::npos) << refused.err;
  EXPECT_FALSE(exists("new.ist"));
  const Outcome wrapped = ist({"bake", "fins.obj", "-o", "new.ist", "--spheres", "20", "--repair",
                               "--wrap", "3%", "--json"});
  ASSERT_EQ(wrapped.exit_code, 0) << wrapped.err;
  EXPECT_NE(wrapped.err.find("wrapped, because: cannot be repaired"), std::string::npos)
      << wrapped.err;
  const nlohmann::json json = nlohmann::json::parse(wrapped.out);
  EXPECT_EQ(json.at("wrapped"), true);
  EXPECT_EQ(json.at("closing").at("method"), "wrap");
  EXPECT_GT(json.at("closing").at("input_max"), 0);
  EXPECT_EQ(ist({"check", "new.ist", "--mesh", "fins.obj", "--wrap", "3%"}).exit_code, 0);
  const Outcome unsaid = ist({"check", "new.ist", "--mesh", "fins.obj"});
  EXPECT_EQ(unsaid.exit_code, 1);
  EXPECT_NE(unsaid.err.find("--wrap"), std::string::npos) << unsaid.err;
  // A closed mesh is left as it is.
  const Outcome closed =
      ist({"bake", "cube.obj", "-o", "cube2.ist", "--spheres", "20", "--wrap", "3%", "--json"});
  ASSERT_EQ(closed.exit_code, 0) << closed.err;
  EXPECT_EQ(nlohmann::json::parse(closed.out).at("wrapped"), false);
}

TEST_F(BakeCommand, ErrorsNameTheFileAndLeaveNothingBehind) {
  expect_error({"bake", "none.obj", "-o", "new.ist"}, "none.obj");
  expect_error({"bake", "cube.obj", "-o", "none/new.ist", "--spheres", "5"}, "none/new.ist");
  expect_error({"bake", "cube.obj", "-o", "/dev/full", "--spheres", "5", "--quiet"}, "/dev/full");
  if (!ist::gpu_available())
    expect_error({"bake", "cube.obj", "-o", "new.ist", "--device", "cuda"}, "--device cpu");
  expect_error({"bake", "cube.ist", "-o", "new.ist"}, "cube.ist");
  expect_error({"bake", "cube.obj", "-o", "new.ist", "--min-radius", "5"}, "cube.obj");
}

TEST_F(BakeCommand, AnOutputThatCannotBeMadeIsSaidBeforeTheWork) {
  // Before even the mesh is looked for.
  expect_error({"bake", "none.obj", "-o", "nowhere/new.ist"}, "the folder nowhere does not exist");
  expect_error({"bake", "none.obj", "-o", "."}, "is a folder; name a file in it");
  expect_error({"medial", "none.obj", "-o", "nowhere/nodes.csv"},
               "the folder nowhere does not exist");
}

TEST_F(BakeCommand, TheMeshIsNeverOverwritten) {
  const std::string before = read("cube.obj");
  expect_error({"bake", "cube.obj", "-o", "./cube.obj", "--spheres", "5"}, "is the input itself");
  EXPECT_EQ(read("cube.obj"), before);
}

TEST_F(BakeCommand, AFailedBakeKeepsTheOldFile) {
  const std::string before = read("cube.ist");
  EXPECT_EQ(ist({"bake", "none.obj", "-o", "cube.ist"}).exit_code, 1);
  EXPECT_EQ(read("cube.ist"), before);
}

/// Coverage and radius are the packing's; the later stages know neither.
TEST_F(BakeCommand, AStageShowsItsOwnProgress) {
  ist::testing::RunOptions options;
  options.terminal = true;
  const Outcome outcome =
      ist({"bake", "capsule.obj", "-o", "new.ist", "--spheres", "2000"}, options);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::size_t packing = 0, later = 0;
  std::istringstream lines(outcome.err);
  for (std::string line; std::getline(lines, line, '\r');) {
    const bool shows_packing = line.find("coverage") != std::string::npos;
    if (line.find("pack ") != std::string::npos) {
      EXPECT_TRUE(shows_packing) << line;
      ++packing;
    } else if (line.find(" %") != std::string::npos) {
      EXPECT_FALSE(shows_packing) << line;
      ++later;
    }
  }
  EXPECT_GT(packing, 0u) << outcome.err;
  EXPECT_GT(later, 0u) << outcome.err;
}

TEST_F(BakeCommand, CtrlCEndsWith130AndWritesNothing) {
  const Outcome outcome = ist({"bake", "cube.obj", "-o", "new.ist", "--spheres", "10000000"},
                              {.environment = {}, .interrupt_after = "CPU"});
  EXPECT_EQ(outcome.exit_code, 130) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_TRUE(new_files().empty()) << new_files().front();
}

}  // namespace
