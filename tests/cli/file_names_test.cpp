#include <fstream>
#include <regex>

#include "cli/program.h"

// Names of files on the command line: none, "-", and endings in any case.

namespace {

using ist::testing::CommandLine;
using ist::testing::lines_of;
using ist::testing::Outcome;

class FileNames : public CommandLine {
 protected:
  void expect_usage_error(const std::vector<std::string>& arguments, const std::string& message) {
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments[0] << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << arguments[0] << "\n" << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_TRUE(new_files().empty()) << new_files().front();
  }
};

TEST_F(FileNames, NoNameIsRefusedBeforeTheWork) {
  for (const char* command : {"bake", "medial"})
    expect_usage_error({command, "cube.obj", "-o", ""}, "--output: '' is not a file name");
  expect_usage_error({"export", "cube.ist", "-o", ""}, "--output: '' is not a file name");
  expect_usage_error({"sample", "cube", "-o", ""}, "--output: '' is not a file name");
  expect_usage_error({"bake", "", "-o", "new.ist"}, "MESH: '' is not a file name");
  expect_usage_error({"info", ""}, "ASSET: '' is not a file name");
  expect_usage_error({"check", "cube.ist", "--mesh", ""}, "--mesh: '' is not a file name");
  expect_usage_error({"query", "cube.ist", "", "--pose", "1,0,0,0,0,0,0"},
                     "B: '' is not a file name");
  expect_usage_error({"query", "cube.ist", "cube.ist", "--poses", ""},
                     "--poses: '' is not a file name");
}

TEST_F(FileNames, ADashIsRefusedWhereItStandsForNothing) {
  expect_usage_error({"bake", "cube.obj", "-o", "-"}, "--output: '-' is not accepted");
  expect_usage_error({"sample", "cube", "-o", "-"}, "--output: '-' is not accepted");
  expect_usage_error({"bake", "-", "-o", "new.ist"}, "MESH: '-' is not accepted");
  expect_usage_error({"medial", "-", "-o", "new.csv"}, "MESH: '-' is not accepted");
  expect_usage_error({"info", "-"}, "ASSET: '-' is not accepted");
  expect_usage_error({"check", "cube.ist", "--mesh", "-"}, "--mesh: '-' is not accepted");
  expect_usage_error({"export", "-", "-o", "new.csv"}, "ASSET: '-' is not accepted");
  expect_usage_error({"query", "-", "cube.ist", "--pose", "1,0,0,0,0,0,0"},
                     "A: '-' is not accepted");
}

TEST_F(FileNames, ADashIsStandardOutputForTables) {
  ASSERT_EQ(ist({"export", "cube.ist", "-o", "s.csv"}).exit_code, 0);
  EXPECT_EQ(ist({"export", "cube.ist", "-o", "-"}).out, read("s.csv"));
  ASSERT_EQ(ist({"medial", "cube.obj", "-o", "nodes.csv", "--resolution", "8"}).exit_code, 0);
  EXPECT_EQ(ist({"medial", "cube.obj", "-o", "-", "--resolution", "8"}).out, read("nodes.csv"));
  EXPECT_FALSE(exists("-"));
  // And a file of that name is still to be had.
  ASSERT_EQ(ist({"bake", "cube.obj", "-o", "./-", "--spheres", "5"}).exit_code, 0);
  EXPECT_EQ(ist({"info", "./-"}).exit_code, 0);
  const std::string command =
      "cd " + folder_.string() + " && " IST_BINARY " export cube.ist -o - >/dev/full 2>err";
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 1);
  EXPECT_NE(read("err").find("standard output"), std::string::npos) << read("err");
}

TEST_F(FileNames, PosesComeFromStandardInput) {
  ist::testing::RunOptions options;
  options.input = "qw,qx,qy,qz,tx,ty,tz\n1,0,0,0,0.5,0,0\n1,0,0,0,3,0,0\n";
  const Outcome outcome = ist({"query", "cube.ist", "cube.ist", "--poses", "-"}, options);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(lines_of(outcome.out).size(), 3u);
  const Outcome none = ist({"query", "cube.ist", "cube.ist", "--poses", "-"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_NE(none.err.find("standard input: is empty"), std::string::npos) << none.err;
}

TEST_F(FileNames, EndingsMayBeInCapitals) {
  for (const std::string ending : {"csv", "ply", "json"}) {
    std::string capitals = ending;
    for (char& c : capitals) c = static_cast<char>(c - 'a' + 'A');
    ASSERT_EQ(ist({"export", "cube.ist", "-o", "s." + ending}).exit_code, 0);
    const Outcome outcome = ist({"export", "cube.ist", "-o", "S." + capitals});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(read("S." + capitals), read("s." + ending));
  }
  for (const std::string ending : {"OBJ", "Ply", "OFF", "Stl"}) {
    const Outcome outcome = ist({"sample", "cube", "-o", "a." + ending});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(ist({"bake", "a." + ending, "-o", "a.ist", "--spheres", "5"}).exit_code, 0);
  }
}

/// Callers of the library may not have the program: its messages advise in terms of the library,
/// for every language.
TEST(Messages, NoneOfTheLibraryNamesAnOptionOfTheProgram) {
  const std::regex option("\"[^\"]*--[a-z]"), every(" in Python | in a manifest ");
  for (const char* folder : {"src", "ist/query", "ist/scene", "ist/c_api", "ist/bullet", "ist/bake",
                             "ist/robots/covers", "cuda", "include"})
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(IST_SOURCE_DIR "/" + std::string(folder))) {
      if (!entry.is_regular_file()) continue;
      std::ifstream file(entry.path());
      for (std::string line; std::getline(file, line);)
        EXPECT_FALSE(std::regex_search(line, option) && !std::regex_search(line, every))
            << entry.path() << ": " << line;
    }
}

}  // namespace
