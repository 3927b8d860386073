// Output in documents equals the program's, except for times.
#include <fstream>
#include <regex>
#include <sstream>

#include "cli/program.h"

namespace {

using ist::testing::CommandLine;
using ist::testing::Outcome;

std::string without_times(const std::string& text) {
  static const std::regex time(" *[0-9][0-9.,]* (µs|ms|s|min)\\b *");
  return std::regex_replace(text, time, " T ");
}

/// The arguments and the output of every block of a document that begins with "$ ist".
std::vector<std::pair<std::vector<std::string>, std::string>> printed(const std::string& document) {
  std::ifstream file(std::string(IST_SOURCE_DIR "/") + document);
  std::vector<std::pair<std::vector<std::string>, std::string>> blocks;
  bool inside = false;
  for (std::string line, before; std::getline(file, line); before = line) {
    if (line.starts_with("$ ist ") && before == "```") {
      std::istringstream words(line.substr(6));
      blocks.emplace_back();
      for (std::string word; words >> word;) blocks.back().first.push_back(word);
      inside = true;
    } else if (line == "```") {
      inside = false;
    } else if (inside) {
      blocks.back().second += line + "\n";
    }
  }
  return blocks;
}

TEST_F(CommandLine, PrintsWhatDocumentsPrint) {
  for (const std::string name : {"bolt", "nut"}) {
    ASSERT_EQ(ist({"sample", name, "-o", name + ".obj"}).exit_code, 0);
    ASSERT_EQ(ist({"bake", name + ".obj", "-o", name + ".ist", "--spheres", "10000", "--quiet"})
                  .exit_code,
              0);
  }
  std::size_t checked = 0;
  for (const char* document : {"README.md", "docs/user_guide.md"}) {
    for (const auto& [arguments, output] : printed(document)) {
      SCOPED_TRACE(std::string(document) + ": ist " + arguments[0]);
      const Outcome outcome = ist(arguments);
      EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
      EXPECT_EQ(without_times(outcome.out), without_times(output));
      ++checked;
    }
  }
  EXPECT_GE(checked, 4u);
}

}  // namespace
