#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace {

using ist::testing::CommandLine;
using ist::testing::lines_of;
using ist::testing::numbers_of;
using ist::testing::Outcome;

constexpr const char* kHeader =
    "id,volume,volume_min,volume_max,cx,cy,cz,force_x,force_y,force_z,torque_x,torque_y,torque_z,"
    "distance,"
    "distance_min,distance_max,status,node_visits,sphere_pairs,time_us,touching,contact_area,"
    "contact_nx,contact_ny,contact_nz";

// Columns of kHeader.
enum Column {
  id,
  volume,
  volume_min,
  volume_max,
  cx,
  force_x = 7,
  distance = 13,
  distance_min,
  distance_max,
  status,
  node_visits,
  sphere_pairs,
  time_us,
  touching,
  contact_area,
  contact_nz = 24
};

class QueryCommand : public CommandLine {
 protected:
  /// Data rows of a CSV answer; the header is checked.
  std::vector<std::string> rows(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "query");
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    std::vector<std::string> lines = lines_of(outcome.out);
    if (lines.empty() || lines.front() != kHeader) {
      ADD_FAILURE() << outcome.out;
      return {};
    }
    lines.erase(lines.begin());
    return lines;
  }
  std::vector<double> row(const std::string& pose, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"cube.ist", "cube.ist", "--csv", "--pose", pose};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const std::vector<std::string> all = rows(arguments);
    return all.size() == 1 ? numbers_of(all.front()) : std::vector<double>(25);
  }
  void expect_exit(int code, std::vector<std::string> arguments, const std::string& message) {
    arguments.insert(arguments.begin(), "query");
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }
};

TEST_F(QueryCommand, HalfACubeOverlapsHalfACube) {
  const std::vector<double> r = row("1,0,0,0,0.5,0,0");
  EXPECT_NEAR(r[volume], 0.5, 0.05);  // 100 spheres
  EXPECT_LE(r[volume_min], r[volume]);
  EXPECT_GE(r[volume_max], r[volume]);
  EXPECT_NEAR(r[cx], 0.25, 0.05);
  EXPECT_GT(r[force_x], 0.5);  // B is pushed along +x, where it lets go of volume
  EXPECT_GT(r[sphere_pairs], 0);
  EXPECT_GT(r[time_us], 0);
}

TEST_F(QueryCommand, APoseMayBeginWithAMinus) {
  EXPECT_EQ(row("-1,0,0,0,0.5,0,0")[volume], row("1,0,0,0,0.5,0,0")[volume]);
}

TEST_F(QueryCommand, FarCubesHaveADistanceAndNoVolume) {
  const std::vector<double> r = row("1,0,0,0,0,0,3");
  EXPECT_EQ(r[volume], 0);
  EXPECT_GE(r[distance], 2);
  EXPECT_LE(r[distance_min], 2);
  EXPECT_GE(r[distance_max], 2);
}

TEST_F(QueryCommand, ScaleOfBIsAboutItsOwnOrigin) {
  // Half the size, at 2: from 1.75 to 2.25 along x; the gap to the unit cube is 1.25.
  const std::vector<double> r = row("1,0,0,0,2,0,0", {"--scale-b", "0.5"});
  EXPECT_LE(r[distance_min], 1.25);
  EXPECT_GE(r[distance_max], 1.25);
  EXPECT_LT(r[distance_max], 1.3);
}

TEST_F(QueryCommand, InnerMeasureIsALowerBound) {
  const double inner = row("1,0,0,0,0.5,0,0", {"--measure", "inner"})[volume];
  EXPECT_GT(inner, 0);
  EXPECT_LT(inner, 0.5);
}

TEST_F(QueryCommand, AnswersARowForARow) {
  write("poses.csv",
        "id,class,meshA,meshB,qw,qx,qy,qz,tx,ty,tz,scale_b\n"
        "first,pen,a,b,1,0,0,0,0.5,0,0,1\n"
        "second,sep,a,b,1,0,0,0,3,0,0,1\n"
        "third,pen,a,b,1,0,0,0,3,0,0,8\n"
        "fourth,other,a,b,0,0,0,0,nan,0,0,1\n");
  const std::vector<std::string> all =
      rows({"cube.ist", "cube.ist", "--poses", "poses.csv", "--repeat", "3"});
  ASSERT_EQ(all.size(), 4u);
  EXPECT_EQ(all[0].substr(0, 6), "first,");
  EXPECT_EQ(all[3].substr(0, 7), "fourth,");
  EXPECT_GT(numbers_of(all[0])[volume], 0);
  EXPECT_EQ(numbers_of(all[1])[volume], 0);
  EXPECT_GT(numbers_of(all[2])[volume], 0) << "the row's own scale overrides";
  EXPECT_NE(all[0].find(",ok,"), std::string::npos);
  EXPECT_NE(all[3].find(",invalid_input,"), std::string::npos);
  // 17 digits bring every double back.
  EXPECT_EQ(numbers_of(all[0])[volume], row("1,0,0,0,0.5,0,0")[volume]);

  const auto of_class = [&](std::vector<std::string> classes) {
    std::vector<std::string> arguments = {"cube.ist", "cube.ist", "--poses", "poses.csv"};
    for (const std::string& name : classes) arguments.insert(arguments.end(), {"--class", name});
    return rows(arguments).size();
  };
  EXPECT_EQ(of_class({"pen"}), 2u);
  EXPECT_EQ(of_class({"pen", "sep"}), 3u);
}

TEST_F(QueryCommand, ABudgetIsNamedInTheStatus) {
  const std::vector<std::string> all =
      rows({"cube.ist", "cube.ist", "--csv", "--pose", "1,0,0,0,0.5,0,0", "--max-visits", "1"});
  ASSERT_EQ(all.size(), 1u);
  EXPECT_NE(all[0].find(",budget_exhausted,"), std::string::npos) << all[0];
}

TEST_F(QueryCommand, DistancesEndAtTheLargestThatMatters) {
  const std::vector<double> farther = row("1,0,0,0,3,0,0", {"--max-distance", "0.25"});
  EXPECT_EQ(farther[distance], 0.25);
  EXPECT_EQ(farther[distance_min], 0.25);
  EXPECT_TRUE(std::isinf(farther[distance_max]));
  const std::vector<double> near = row("1,0,0,0,3,0,0", {"--max-distance", "2.5"});
  EXPECT_EQ(near[distance], row("1,0,0,0,3,0,0")[distance]);
  const Outcome text =
      ist({"query", "cube.ist", "cube.ist", "--pose", "1,0,0,0,3,0,0", "--max-distance", "0.25"});
  EXPECT_NE(text.out.find("> 0.25 u"), std::string::npos) << text.out;
  expect_exit(2, {"cube.ist", "cube.ist", "--pose", "1,0,0,0,3,0,0", "--max-distance", "-1"},
              "--max-distance");
}

TEST_F(QueryCommand, APairBudgetTakesACoarserLevel) {
  ASSERT_EQ(ist({"bake", "cube.obj", "-o", "fine.ist", "--spheres", "1000"}).exit_code, 0);
  const auto row = [&](const char* budget) {
    const auto all = rows(
        {"fine.ist", "fine.ist", "--csv", "--pose", "1,0,0,0,0.4,0.1,0", "--pair-budget", budget});
    return numbers_of(all.at(0));
  };
  const auto finest = row("0"), coarse = row("10");
  EXPECT_NEAR(coarse[1], finest[1], 0.05 * finest[1]);
  EXPECT_NE(coarse[1], finest[1]);
}

TEST_F(QueryCommand, AnErrorIsAcceptedAsAShare) {
  const std::string pose = "0.9,0.1,0.3,0.2,0.9,0.3,0.2";
  const auto volume = [&](const std::vector<std::string>& more) { return row(pose, more)[1]; };
  const double exact = volume({"--measure", "exact"});
  EXPECT_NE(volume({}), exact);
  // Few triangles cross.
  EXPECT_EQ(volume({"--error", "0.5%"}), exact);
  EXPECT_EQ(volume({"--error", "0.005"}), exact);
  EXPECT_EQ(volume({"--error", "0"}), volume({}));
  const Outcome shown = ist({"query", "cube.ist", "cube.ist", "--pose", pose, "--error", "0.5%"});
  EXPECT_NE(shown.out.find("accepted; predicted error is smaller"), std::string::npos) << shown.out;

  // Without a mesh nothing is exact enough, and that is said.
  ASSERT_EQ(
      ist({"bake", "cube.obj", "-o", "bare.ist", "--spheres", "50", "--keep-mesh", "no"}).exit_code,
      0);
  const auto all = rows({"bare.ist", "cube.ist", "--csv", "--pose", pose, "--error", "0.5%"});
  ASSERT_EQ(all.size(), 1u);
  EXPECT_NE(all[0].find(",error_exceeded,"), std::string::npos) << all[0];
  const Outcome more = ist({"query", "bare.ist", "cube.ist", "--pose", pose, "--error", "0.5%"});
  EXPECT_NE(more.out.find("accepted; predicted error is larger"), std::string::npos) << more.out;

  for (const char* const text : {"-1%", "1", "100%", "nan", "half", "5 %"})
    expect_exit(2, {"cube.ist", "cube.ist", "--pose", pose, "--error", text}, "--error");
  for (const char* const measure : {"inner", "exact"})
    expect_exit(2, {"cube.ist", "cube.ist", "--pose", pose, "--error", "1%", "--measure", measure},
                std::string("--error: has no effect with --measure ") + measure);
  expect_exit(2, {"ball:1", "cube.ist", "--pose", pose, "--error", "1%"},
              "--error: has no effect where A is a shape: ball:1");
}

TEST_F(QueryCommand, JsonHasTheColumnsOfTheCsv) {
  const Outcome outcome =
      ist({"query", "cube.ist", "cube.ist", "--pose", "1,0,0,0,0.5,0,0", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::ordered_json json = nlohmann::ordered_json::parse(outcome.out);
  ASSERT_EQ(json.size(), 1u);
  std::string keys;
  for (const auto& [key, value] : json[0].items()) keys += (keys.empty() ? "" : ",") + key;
  EXPECT_EQ(keys, kHeader);
  EXPECT_EQ(json[0].at("volume").get<double>(), row("1,0,0,0,0.5,0,0")[volume]);
}

TEST_F(QueryCommand, OnePoseIsAnsweredForAPerson) {
  const Outcome outcome = ist({"query", "cube.ist", "capsule.ist", "--pose", "1,0,0,0,0,0,0"});
  EXPECT_EQ(outcome.exit_code, 0);
  for (const char* word : {"volume", "sum range", "force/k", "torque/k", "distance", "µs"})
    EXPECT_NE(outcome.out.find(word), std::string::npos) << word;
  // Spheres report nothing that could be mistaken for accuracy.
  EXPECT_EQ(outcome.out.find("bounds"), std::string::npos) << outcome.out;
}

// --- Exact
// ----------------------------------------------------------------------------------------

constexpr const char* kNutOnBolt = "1,0,0,0,0,0,8.5";
constexpr double kTruth = 34.7409603139359;

class ExactQueryCommand : public QueryCommand {
 protected:
  void SetUp() override {
    QueryCommand::SetUp();
    for (const std::string name : {"bolt", "nut"}) {
      ASSERT_EQ(ist({"sample", name, "-o", name + ".obj"}).exit_code, 0);
      const Outcome baked = ist({"bake", name + ".obj", "-o", name + ".ist", "--mesh-only"});
      ASSERT_EQ(baked.exit_code, 0) << baked.err;
    }
  }
};

TEST_F(ExactQueryCommand, TellsTheTrueVolumeOfSurfacesAlone) {
  const std::vector<std::string> asked = {"bolt.ist", "nut.ist",   "--pose",
                                          kNutOnBolt, "--measure", "exact"};
  std::vector<std::string> by_csv = asked, by_json = asked;
  by_csv.push_back("--csv");
  const std::vector<std::string> all = rows(by_csv);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_NE(all[0].find(",ok,"), std::string::npos) << all[0];
  const std::vector<double> r = numbers_of(all[0]);
  EXPECT_NEAR(r[volume], kTruth, 1e-11 * kTruth);
  EXPECT_LE(r[volume_min], kTruth + 1e-13);  // to the digits that the truth is written with
  EXPECT_GE(r[volume_max], kTruth - 1e-13);
  EXPECT_LT(r[volume_max] - r[volume_min], 1e-9 * kTruth);
  EXPECT_NEAR(r[force_x + 2], -71.734, 1e-3);
  EXPECT_EQ(r[distance], 0);
  EXPECT_GT(r[time_us], 0);

  by_json.insert(by_json.begin(), "query");
  by_json.push_back("--json");
  const nlohmann::ordered_json entry = nlohmann::ordered_json::parse(ist(by_json).out)[0];
  EXPECT_EQ(entry.at("volume").get<double>(), r[volume]);
  EXPECT_EQ(entry.at("status"), "ok");
  EXPECT_EQ(entry.at("distance").get<double>(), 0);

  std::vector<std::string> by_text = asked;
  by_text.insert(by_text.begin(), "query");
  const Outcome text = ist(by_text);
  EXPECT_EQ(text.exit_code, 0);
  for (const char* words : {"34.74096031393", "of the true overlap", "bounds",
                            "contain the true volume", "-71.734", "triangle pairs"})
    EXPECT_NE(text.out.find(words), std::string::npos) << words << "\n" << text.out;
}

TEST_F(ExactQueryCommand, TellsHowSolidsTouch) {
  const auto ask = [&](const std::string& pose, const std::string& measure) {
    return nlohmann::ordered_json::parse(
        ist({"query", "cube.ist", "cube.ist", "--pose", pose, "--measure", measure, "--json"})
            .out)[0];
  };
  const nlohmann::ordered_json flush = ask("1,0,0,0,0.5,0,1", "exact");
  EXPECT_EQ(flush.at("volume"), 0);
  EXPECT_EQ(flush.at("touching"), true);
  EXPECT_NEAR(flush.at("contact_area").get<double>(), 0.5, 1e-12);
  EXPECT_NEAR(flush.at("contact_nz").get<double>(), 1, 1e-12);
  const nlohmann::ordered_json edge = ask("1,0,0,0,1,0,1", "exact");
  EXPECT_EQ(edge.at("touching"), true);
  EXPECT_EQ(edge.at("contact_area"), 0);
  for (const char* pose : {"1,0,0,0,0.5,0,1.000000001", "1,0,0,0,0.5,0,0.999999999"})
    EXPECT_EQ(ask(pose, "exact").at("touching"), false) << pose;
  EXPECT_EQ(ask("1,0,0,0,0.5,0,1", "matched").at("touching"), nullptr);

  EXPECT_EQ(row("1,0,0,0,0.5,0,1", {"--measure", "exact"})[contact_nz], 1);
  const Outcome text =
      ist({"query", "cube.ist", "cube.ist", "--pose", "1,0,0,0,0.5,0,1", "--measure", "exact"});
  EXPECT_NE(text.out.find("touching   0.5 u²"), std::string::npos) << text.out;
}

TEST_F(ExactQueryCommand, TellsTheDistanceOfSurfaces) {
  const Outcome apart =
      ist({"query", "cube.ist", "capsule.ist", "--pose", "1,0,0,0,0,0,9", "--measure", "exact"});
  EXPECT_EQ(apart.exit_code, 0) << apart.err;
  EXPECT_NE(apart.out.find("between the surfaces"), std::string::npos) << apart.out;
  EXPECT_NE(apart.out.find("volume     0 u³"), std::string::npos) << apart.out;
  const std::vector<double> r = row("1,0,0,0,0.5,0,0", {"--measure", "exact"});
  EXPECT_NEAR(r[volume], 0.5, 1e-12);
  EXPECT_NEAR(r[force_x], 1, 1e-12);
}

TEST_F(ExactQueryCommand, ALimitLeavesBoundsThatHold) {
  const auto all = rows({"bolt.ist", "nut.ist", "--csv", "--pose", kNutOnBolt, "--measure", "exact",
                         "--max-visits", "3"});
  ASSERT_EQ(all.size(), 1u);
  EXPECT_NE(all[0].find(",budget_exhausted,"), std::string::npos) << all[0];
  const std::vector<double> r = numbers_of(all[0]);
  EXPECT_TRUE(std::isnan(r[volume]));  // no spheres to answer instead
  EXPECT_EQ(r[volume_min], 0);
  EXPECT_GT(r[volume_max], kTruth);
  const Outcome text = ist({"query", "bolt.ist", "nut.ist", "--pose", kNutOnBolt, "--measure",
                            "exact", "--max-visits", "3"});
  EXPECT_NE(text.out.find("volume     unknown"), std::string::npos) << text.out;
  EXPECT_EQ(text.out.find("nan"), std::string::npos) << text.out;
}

TEST_F(ExactQueryCommand, SaysWhatIsNotHeld) {
  ASSERT_EQ(
      ist({"bake", "cube.obj", "-o", "bare.ist", "--spheres", "50", "--keep-mesh", "no"}).exit_code,
      0);
  expect_exit(
      1, {"cube.ist", "bare.ist", "--pose", "1,0,0,0,0,0,0", "--measure", "exact"},
      "bare.ist: has no mesh, which --measure exact needs; bake it again with --keep-mesh yes");
  for (const char* measure : {"matched", "inner"})
    expect_exit(1, {"cube.ist", "nut.ist", "--pose", "1,0,0,0,0,0,0", "--measure", measure},
                "nut.ist: has no spheres, which --measure " + std::string(measure) +
                    " needs; use --measure exact");
  expect_exit(1, {"ball:1", "nut.ist", "--pose", "1,0,0,0,0,0,0"}, "nut.ist: has no spheres");
}

TEST_F(ExactQueryCommand, AnAcceptedErrorNeedsNoSpheres) {
  const auto volume = [&](const std::string& option, const std::string& value) {
    const Outcome outcome =
        ist({"query", "bolt.ist", "nut.ist", "--pose", kNutOnBolt, "--csv", option, value});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return numbers_of(lines_of(outcome.out).at(1))[1];
  };
  EXPECT_EQ(volume("--error", "1%"), volume("--measure", "exact"));
}

TEST_F(ExactQueryCommand, RefusesWhatItDoesNotHeed) {
  const auto refused = [&](const std::vector<std::string>& more, const std::string& message) {
    std::vector<std::string> all = {"bolt.ist", "nut.ist",   "--pose",
                                    kNutOnBolt, "--measure", "exact"};
    all.insert(all.end(), more.begin(), more.end());
    expect_exit(2, all, message);
  };
  refused({"--spheres-only"}, "--spheres-only: has no effect with --measure exact");
  refused({"--pair-budget", "9"}, "--pair-budget: has no effect with --measure exact");
  expect_exit(2, {"plane:0,0,1,0", "nut.ist", "--pose", kNutOnBolt, "--measure", "exact"},
              "exact needs the meshes of two assets, and A is a shape: plane:0,0,1,0");
}

TEST_F(QueryCommand, WrongInputIsNamed) {
  expect_exit(1, {"none.ist", "cube.ist", "--pose", "1,0,0,0,0,0,0"}, "none.ist");
  expect_exit(1, {"cube.obj", "cube.ist", "--pose", "1,0,0,0,0,0,0"}, "cube.obj");
  expect_exit(1, {"cube.ist", "cube.ist", "--poses", "none.csv"}, "none.csv");
  write("short.csv", "id,qw,qx,qy,qz,tx,ty\n");
  expect_exit(1, {"cube.ist", "cube.ist", "--poses", "short.csv"}, "'tz'");
  write("word.csv", "qw,qx,qy,qz,tx,ty,tz\n1,0,0,0,0,0,0\n1,0,0,0,zero,0,0\n");
  expect_exit(1, {"cube.ist", "cube.ist", "--poses", "word.csv"}, "word.csv:3");
  write("ragged.csv", "qw,qx,qy,qz,tx,ty,tz\n1,0,0,0,0,0\n");
  expect_exit(1, {"cube.ist", "cube.ist", "--poses", "ragged.csv"}, "ragged.csv:2");

  std::string bytes = read("cube.ist");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  write("flipped.ist", bytes);
  expect_exit(1, {"flipped.ist", "cube.ist", "--pose", "1,0,0,0,0,0,0"}, "flipped.ist");
}

TEST_F(QueryCommand, WrongUsageExitsWith2) {
  expect_exit(2, {"cube.ist", "cube.ist"}, "pose");
  expect_exit(2, {"cube.ist", "--pose", "1,0,0,0,0,0,0"}, "");
  expect_exit(2, {"cube.ist", "cube.ist", "--pose", "1,0,0"}, "1,0,0");
  expect_exit(2, {"cube.ist", "cube.ist", "--pose", "1,0,0,0,0,0,x"}, "tz = 'x' is not a number");
  expect_exit(2, {"cube.ist", "cube.ist", "--pose", "1,0,0,0,0,0,0", "--scale-b", "0"}, "scale-b");
  expect_exit(2, {"cube.ist", "cube.ist", "--pose", "1,0,0,0,0,0,0", "--measure", "x"}, "measure");
  expect_exit(2, {"cube.ist", "cube.ist", "--pose", "1,0,0,0,0,0,0", "--csv", "--json"}, "json");
  expect_exit(2, {"cube.ist", "cube.ist", "--pose", "1,0,0,0,0,0,0", "--class", "pen"}, "--poses");
  expect_exit(2,
              {"cube.ist", "cube.ist", "--pose", "1,0,0,0,0,0,0", "--measure", "inner",
               "--pair-budget", "10"},
              "--pair-budget: has no effect");
}

TEST_F(QueryCommand, AnInvalidPoseIsNoZeroForAPerson) {
  const Outcome outcome = ist({"query", "cube.ist", "cube.ist", "--pose", "0,0,0,0,0,0,0"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_NE(outcome.out.find("invalid_input"), std::string::npos) << outcome.out;
  EXPECT_EQ(outcome.out.find("volume"), std::string::npos) << outcome.out;
}

TEST_F(QueryCommand, AQuaternionOfAnyLengthIsNormalised) {
  EXPECT_EQ(row("2,0,0,0,0.5,0,0")[volume], row("1,0,0,0,0.5,0,0")[volume]);
}

TEST_F(QueryCommand, AByteOrderMarkAndCarriageReturnsAreNoPartOfACsv) {
  write("poses.csv", "\xEF\xBB\xBFqw,qx,qy,qz,tx,ty,tz\r\n1,0,0,0,0.5,0,0\r\n");
  const std::vector<std::string> all = rows({"cube.ist", "cube.ist", "--poses", "poses.csv"});
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(numbers_of(all[0])[volume], row("1,0,0,0,0.5,0,0")[volume]);
}

TEST_F(QueryCommand, AnswersThatCannotBeWrittenAreAnError) {
  const std::string command = "cd " + folder_.string() +
                              " && " IST_BINARY
                              " query cube.ist cube.ist --pose 1,0,0,0,0,0,0 >/dev/full 2>err";
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 1);
  EXPECT_NE(read("err").find("standard output"), std::string::npos) << read("err");
}

/// The program uses the C locale whatever the user's locale.
TEST_F(QueryCommand, NumbersDoNotDependOnTheLocale) {
  const std::string command =
      "localedef -i de_DE -f UTF-8 " + (folder_ / "de_DE.UTF-8").string() + " >/dev/null 2>&1";
  if (std::system(command.c_str()) != 0) GTEST_SKIP() << "no localedef or no German locale here";
  const std::vector<std::string> arguments = {"query",  "cube.ist",        "cube.ist",  "--csv",
                                              "--pose", "1,0,0,0,0.5,0,0", "--scale-b", "1.25"};
  const Outcome german =
      ist(arguments, {.environment = {"LOCPATH=" + folder_.string(), "LC_ALL=de_DE.UTF-8"},
                      .interrupt_after = ""});
  const auto upto_time = [](const std::string& out) { return out.substr(0, out.rfind(",ok,")); };
  EXPECT_EQ(upto_time(german.out), upto_time(ist(arguments).out));
}

}  // namespace
