#include <nlohmann/json.hpp>

#include "cli/program.h"

// Poses in a CSV: read right, or refused with the column or line that is wrong.

namespace {

using ist::testing::CommandLine;
using ist::testing::lines_of;
using ist::testing::Outcome;

const std::string kPose = "qw,qx,qy,qz,tx,ty,tz";

class PoseTable : public CommandLine {
 protected:
  Outcome ask(const std::string& table, const std::vector<std::string>& more = {}) {
    write("poses.csv", table);
    std::vector<std::string> arguments = {"query", "cube.ist", "cube.ist", "--poses", "poses.csv"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return ist(arguments);
  }
  nlohmann::json answers(const std::string& table, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = ask(table, arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out.empty() ? "[]" : outcome.out);
  }
  void expect_refused(const std::string& table, const std::string& message,
                      const std::vector<std::string>& more = {}, int code = 1) {
    const Outcome outcome = ask(table, more);
    EXPECT_EQ(outcome.exit_code, code) << table << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << message << "\n" << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }
};

TEST_F(PoseTable, WithoutRowsItIsAnError) {
  expect_refused(kPose + "\n", "poses.csv: no rows after the header");
  expect_refused(kPose + "\n\n  \n", "poses.csv: no rows after the header");
  expect_refused("", "poses.csv: is empty; the first row must be the header");
  expect_refused("\n\n", "poses.csv: is empty; the first row must be the header");
}

TEST_F(PoseTable, BlankLinesAreNoRows) {
  const nlohmann::json json = answers("\n \r\n" + kPose + "\r\n\r\n1,0,0,0,3,0,0\r\n\r\n");
  ASSERT_EQ(json.size(), 1u);
  EXPECT_GT(json[0].at("distance"), 1.9);
  // Lines count all the same.
  expect_refused("\n\n" + kPose + "\n\n1,0,0,0,x,0,0\n", "poses.csv:5: 'x' in column 'tx'");
}

TEST_F(PoseTable, QuotedFieldsHoldAnything) {
  const std::string table = "id,\"class\"," + kPose +
                            "\n\"a, b\",\"x,y\",1,0,0,0,\"3\",0,0\n"
                            "\"say \"\"so\"\"\n\nand so\", \"z\" ,1,0,0,0,0.5,0,0\n";
  const nlohmann::json json = answers(table);
  ASSERT_EQ(json.size(), 2u);
  EXPECT_EQ(json[0].at("id"), "a, b");
  EXPECT_GT(json[0].at("distance"), 1.9);
  EXPECT_EQ(json[1].at("id"), "say \"so\"\n\nand so");
  EXPECT_GT(json[1].at("volume"), 0.4);
  EXPECT_EQ(answers(table, {"--class", "x,y"}).size(), 1u);
  EXPECT_EQ(answers(table, {"--class", "z"}).size(), 1u);
  // A quoted field is written as one again.
  const Outcome csv = ask(table);
  EXPECT_NE(csv.out.find("\n\"a, b\",0,"), std::string::npos) << csv.out;
  EXPECT_NE(csv.out.find("\n\"say \"\"so\"\"\n\nand so\","), std::string::npos) << csv.out;

  expect_refused(kPose + "\n1,0,0,0,\"3,0,0\n", "poses.csv:2: a closing quote is missing");
  expect_refused(kPose + "\n1,0,0,0,\"3\"4,0,0\n", "poses.csv:2: text after a closing quote");
  expect_refused(kPose + "\n1,0,0,0,3\"4,0,0\n", "poses.csv:2: a quote inside an unquoted field");
}

TEST_F(PoseTable, ColumnsThatMayBeMeantAreRefused) {
  const std::string row = "\n2,1,0,0,0,0,0,0\n";
  for (const std::string name : {"Scale_B", "scale_B", "scaleb", "Scale B", "scale-b"})
    expect_refused(name + "," + kPose + row,
                   "poses.csv:1: column '" + name + "' must be spelled 'scale_b'");
  expect_refused("ID," + kPose + row, "column 'ID' must be spelled 'id'");
  expect_refused("Class," + kPose + row, "column 'Class' must be spelled 'class'");
  expect_refused("TX," + kPose + row, "column 'TX' must be spelled 'tx'");
  expect_refused("tx," + kPose + row, "poses.csv:1: column 'tx' appears twice");
  expect_refused("scale_b,scale_b," + kPose + "\n1,2,1,0,0,0,0,0,0\n",
                 "column 'scale_b' appears twice");
  // Others are the user's own affair.
  EXPECT_EQ(answers("mesh,mesh," + kPose + "\n1,2,1,0,0,0,0,0,0\n").size(), 1u);
}

TEST_F(PoseTable, OneScaleOnly) {
  const std::string table = "scale_b," + kPose + "\n0.5,1,0,0,0,2,0,0\n";
  EXPECT_NEAR(answers(table)[0].at("distance"), 1.25, 0.05);
  expect_refused(table, "--scale-b: conflicts with the column scale_b of poses.csv",
                 {"--scale-b", "2"}, 2);
  EXPECT_NEAR(answers(kPose + "\n1,0,0,0,2,0,0\n", {"--scale-b", "0.5"})[0].at("distance"), 1.25,
              0.05);
}

TEST_F(PoseTable, ClassesWithoutRowsAreRefused) {
  const std::string table = "class," + kPose + "\npen,1,0,0,0,0.5,0,0\n";
  EXPECT_EQ(answers(table, {"--class", "pen"}).size(), 1u);
  expect_refused(table, "none of the 1 rows has the class 'pne'", {"--class", "pne"});
  expect_refused(table, "none of the 1 rows has the class 'pne'",
                 {"--class", "pen", "--class", "pne"});
  expect_refused(kPose + "\n1,0,0,0,0,0,0\n", "no column 'class'", {"--class", "pen"});
}

/// The number that is wrong, not another, and why.
TEST_F(PoseTable, WhatIsWrongWithAPoseIsSaid) {
  const auto expect_said = [&](const std::string& pose, const std::string& message,
                               const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"query", "cube.ist", "cube.ist", "--pose", pose};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("no answer"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find(message), std::string::npos) << message << "\n" << outcome.out;
  };
  expect_said("1,0,0,0,0,0,1e70", "tz is 1e+70, out of range");
  expect_said("1,0,0,0,5,-2e61,3", "ty is -2e+61, out of range");
  expect_said("1,0,0,0,0,0,0", "scale_b is 1e+70, out of range", {"--scale-b", "1e70"});
  expect_said("1,0,0,0,0,0,0", "scale_b is 1e-70, out of range", {"--scale-b", "1e-70"});
  expect_said("1,0,0,0,0,nan,0", "ty is nan");
  expect_said("1,inf,0,0,0,0,0", "qx is inf");
  expect_said("0,0,0,0,0,0,0", "quaternion qw,qx,qy,qz has length 0");
}

}  // namespace
