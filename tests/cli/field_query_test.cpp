#include <ist/bake.h>
#include <ist/query.h>
#include <ist/shapes.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "cli/program.h"

// ist query with a solid that has no asset, and assets without a mesh.

namespace {

using ist::testing::CommandLine;
using ist::testing::lines_of;
using ist::testing::numbers_of;
using ist::testing::Outcome;

class FieldQuery : public CommandLine {
 protected:
  /// The object that JSON has for one pose.
  nlohmann::json asked(const std::string& a, const std::string& b, const std::string& pose,
                       const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments = {"query", a, b, "--json", "--pose", pose};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.exit_code == 0 ? nlohmann::json::parse(outcome.out).at(0) : nlohmann::json();
  }
  double volume(const std::string& a, const std::string& pose,
                const std::vector<std::string>& more = {}) const {
    return asked(a, "cube.ist", pose, more).value("volume", -1.0);
  }
  void expect_exit(int code, std::vector<std::string> arguments, const std::string& message) const {
    arguments.insert(arguments.begin(), "query");
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }
};

constexpr const char* kAtOrigin = "1,0,0,0,0,0,0";

TEST_F(FieldQuery, ACubeInTheFloorHasItsExactVolume) {
  const nlohmann::json answer = asked("plane:0,0,1,0", "cube.ist", "1,0,0,0,0,0,0.2");
  EXPECT_NEAR(answer["volume"].get<double>(), 0.3, 0.005);  // 100 spheres
  EXPECT_NEAR(answer["force_z"].get<double>(), 1, 0.05);
  EXPECT_NEAR(answer["cz"].get<double>(), -0.15, 0.005);
  EXPECT_EQ(answer["distance"], 0);
  EXPECT_EQ(answer["status"], "ok");
  const nlohmann::json above = asked("plane:0,0,1,0", "cube.ist", "1,0,0,0,0,0,1.5");
  EXPECT_EQ(above["volume"], 0);
  EXPECT_LE(above["distance_min"].get<double>(), 1);
  EXPECT_GE(above["distance_max"].get<double>(), 1);
}

TEST_F(FieldQuery, APlaneIsTheSolidWhateverItsNormalsLength) {
  const double expected = volume("plane:0,0,1,0.5", "1,0,0,0,0,0,0.8");
  EXPECT_NEAR(expected, 0.2, 0.005);
  EXPECT_EQ(volume("plane:0,0,4,2", "1,0,0,0,0,0,0.8"), expected);
  EXPECT_NEAR(volume("plane:-3,0,0,0", "1,0,0,0,0.25,0,0"), 0.75, 0.01) << "outward is −x";
}

TEST_F(FieldQuery, EveryKindMeetsTheCube) {
  EXPECT_NEAR(volume("box:1,1,0.5", "1,0,0,0,0,0,0.6"), 0.4, 0.01);
  EXPECT_NEAR(volume("ball:0.3", kAtOrigin), 4 * std::numbers::pi / 3 * 0.027, 0.002);
  EXPECT_NEAR(volume("ball:9", kAtOrigin), 1, 1e-5);
  EXPECT_NEAR(volume("capsule:5,9", kAtOrigin), 1, 1e-5);
  EXPECT_NEAR(volume("cylinder:50,9", "1,0,0,0,0,0,9.25"), 0.25, 0.01);
  EXPECT_GT(volume("ball:2", "1,0,0,0,0,0,3", {"--scale-b", "4"}), 0);
  EXPECT_EQ(volume("ball:2", "1,0,0,0,0,0,3"), 0);
}

TEST_F(FieldQuery, PosesAreOfBInTheFieldsFrame) {
  write("poses.csv",
        "id,qw,qx,qy,qz,tx,ty,tz,scale_b\n"
        "half,1,0,0,0,0,0,0,1\n"
        "twice,1,0,0,0,0,0,0.5,2\n"
        "none,nan,0,0,0,0,0,0,1\n");
  const Outcome outcome = ist({"query", "plane:0,0,1,0", "cube.ist", "--poses", "poses.csv"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<std::string> lines = lines_of(outcome.out);
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_NEAR(numbers_of(lines[1])[1], 0.5, 0.01);
  EXPECT_NEAR(numbers_of(lines[2])[1], 2, 0.04);
  EXPECT_NE(lines[3].find(",invalid_input,"), std::string::npos) << lines[3];
}

TEST_F(FieldQuery, APoseThatIsNoPoseSaysWhy) {
  const Outcome outcome = ist({"query", "ball:1", "cube.ist", "--pose", "1,0,0,0,0,0,nan"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_NE(outcome.out.find("invalid_input: tz is nan"), std::string::npos) << outcome.out;
}

TEST_F(FieldQuery, OfTwoAssetsOfUnlikeSizesMeshesAnswerUnlessSpheresAloneAreAsked) {
  ASSERT_EQ(ist({"bake", "cube.obj", "-o", "fine.ist", "--spheres", "1000"}).exit_code, 0);
  const auto a = ist::Asset::load(folder_ / "cube.ist");
  const auto b = ist::Asset::load(folder_ / "fine.ist");
  ist::Workspace workspace;
  const auto expected = [&](bool spheres_only) {
    return ist::penetration({a.view(), {}}, {b.view(), {.t = {0.9, 0.1, 0}}},
                            {.spheres_only = spheres_only}, workspace)
        .volume;
  };
  const auto answer = [&](const std::vector<std::string>& more) {
    return asked("cube.ist", "fine.ist", "1,0,0,0,0.9,0.1,0", more)["volume"].get<double>();
  };
  EXPECT_EQ(answer({"--spheres-only"}), expected(true));
  EXPECT_EQ(answer({}), expected(false));
  EXPECT_NE(answer({"--spheres-only"}), answer({}));
}

TEST_F(FieldQuery, AFileNamedLikeAFieldIsReadByItsPath) {
  write("ball:1", read("cube.ist"));
  EXPECT_EQ(volume("./ball:1", "1,0,0,0,0.5,0,0"), volume("cube.ist", "1,0,0,0,0.5,0,0"));
}

TEST_F(FieldQuery, WrongDescriptionsAreUsageErrors) {
  const auto refused = [&](const std::string& a, const std::string& message) {
    expect_exit(2, {a, "cube.ist", "--pose", kAtOrigin}, message);
  };
  refused("plane:0,0,0,1", "the normal is zero");
  refused("plane:0,0,1", "it has 3 numbers, not 4; write plane:nx,ny,nz,d");
  refused("plane:1e-300,0,0,1", "more than 1e+150");
  refused("plane:nan,0,0,1", "nx = 'nan' is not a finite number");
  refused("box:1,-1,1", "hy = -1 is not above 0");
  refused("box:1,1,1,", "it has 4 numbers, not 3; write box:hx,hy,hz");
  refused("ball:", "r = '' is not a finite number");
  refused("ball:0", "r = 0 is not above 0");
  refused("ball:1e200", "more than 1e+150");
  refused("ball:1 m", "r = '1 m'");
  refused("capsule:1,-1", "h = -1 is not 0 or more");
  refused("cylinder:1,0", "h = 0 is not above 0");
  refused("cylinder:1", "it has 1 number, not 2");
  expect_exit(1, {"sphere:1", "cube.ist", "--pose", kAtOrigin}, "sphere:1");
}

TEST_F(FieldQuery, OnlyTheFirstMayBeAField) {
  for (const char* const a : {"cube.ist", "ball:1"})
    expect_exit(2, {a, "plane:0,0,1,0", "--pose", kAtOrigin},
                "B: 'plane:0,0,1,0' is a shape, and only A can be a shape. Pass it first");
  write("ball:1", read("cube.ist"));
  EXPECT_EQ(asked("cube.ist", "./ball:1", "1,0,0,0,0.5,0,0")["volume"],
            asked("cube.ist", "cube.ist", "1,0,0,0,0.5,0,0")["volume"]);
}

TEST_F(FieldQuery, SettingsThatHaveNoEffectAreRefused) {
  const auto refused = [&](const std::string& a, std::vector<std::string> more,
                           const std::string& message) {
    more.insert(more.begin(), {a, "cube.ist", "--pose", kAtOrigin});
    expect_exit(2, more, message);
  };
  refused("ball:1", {"--spheres-only"}, "--spheres-only: has no effect where A is a shape");
  refused("ball:1", {"--pair-budget", "10"}, "--pair-budget: has no effect where A is a shape");
  refused("cube.ist", {"--spheres-only", "--measure", "inner"}, "--spheres-only: has no effect");
}

/// Once, and only where meshes could have answered.
TEST_F(FieldQuery, WarnsOfSpheresThatDoNotFit) {
  ASSERT_EQ(ist({"bake", "cube.obj", "-o", "bare.ist", "--spheres", "100", "--keep-mesh", "no"})
                .exit_code,
            0);
  const std::vector<std::string> asked = {"query", "bare.ist", "cube.ist", "--pose", kAtOrigin};
  const auto warnings = [&](std::vector<std::string> arguments,
                            const std::vector<std::string>& more) {
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    std::size_t count = 0;
    for (std::size_t at = outcome.err.find("warning"); at != std::string::npos;
         at = outcome.err.find("warning", at + 1))
      ++count;
    return count;
  };
  EXPECT_EQ(warnings(asked, {}), 0u);
  EXPECT_EQ(warnings(asked, {"--scale-b", "0.3"}), 0u);
  EXPECT_EQ(warnings(asked, {"--scale-b", "0.2", "--repeat", "3"}), 1u);
  EXPECT_EQ(warnings(asked, {"--scale-b", "0.2", "--spheres-only"}), 0u);
  EXPECT_EQ(warnings(asked, {"--scale-b", "0.2", "--measure", "inner"}), 0u);
  EXPECT_EQ(warnings(asked, {"--scale-b", "5"}), 1u);
  EXPECT_NE(ist({"query", "bare.ist", "cube.ist", "--pose", kAtOrigin, "--scale-b", "0.1"})
                .err.find("bare.ist: its spheres are 10 times as coarse"),
            std::string::npos);
}

}  // namespace
