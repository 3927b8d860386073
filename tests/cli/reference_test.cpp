#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/program.h"

// The program's own reference, and the scene that it exports.

namespace {

using ist::testing::CommandLine;
using ist::testing::lines_of;
using ist::testing::Outcome;

class Reference : public CommandLine {
 protected:
  /// The commands that `ist --help` lists.
  std::vector<std::string> commands() const {
    std::vector<std::string> names;
    bool listed = false;
    for (const std::string& line : lines_of(ist({"--help"}).out)) {
      if (listed && line.starts_with("  ") && line[2] != ' ')
        names.push_back(line.substr(2, line.find(' ', 2) - 2));
      listed = listed || line == "Subcommands:";
    }
    return names;
  }
  /// The words that bash offers for the last of a command line.
  std::vector<std::string> offered(const std::vector<std::string>& line) const {
    std::string script = "source ./completion.bash; COMP_WORDS=(";
    for (const std::string& word : line) script += "'" + word + "' ";
    script += "); COMP_CWORD=" + std::to_string(line.size() - 1) +
              "; compopt() { echo files; }; _ist; printf '%s\\n' \"${COMPREPLY[@]}\"";
    write("try", script);
    const std::string command = "cd '" + folder_.string() + "' && bash try > offered";
    EXPECT_EQ(std::system(command.c_str()), 0);
    std::vector<std::string> words;
    for (const std::string& word : lines_of(read("offered")))
      if (!word.empty()) words.push_back(word);
    return words;
  }
};

TEST_F(Reference, EveryCommandHasAManPage) {
  ASSERT_EQ(ist({"manual", "-o", "man"}).exit_code, 0);
  const std::vector<std::string> names = commands();
  ASSERT_GE(names.size(), 9u);
  const std::string all = read("man/ist.1");
  for (const std::string& name : names) {
    EXPECT_NE(all.find("ist\\-" + name + " (1)"), std::string::npos) << name;
    const std::string page = read("man/ist-" + name + ".1");
    EXPECT_EQ(page.find(".TH \"IST-" + name + "\" 1"), 0u) << page;
    EXPECT_NE(page.find("\\-\\-help"), std::string::npos) << name;
  }
  EXPECT_NE(read("man/ist-bake.1").find("\\fB\\-\\-spheres\\fR \\fIINT\\fR"), std::string::npos);
  EXPECT_NE(read("man/ist-bake.1").find("One of: auto, cpu, cuda. Default: auto."),
            std::string::npos);
}

TEST_F(Reference, ManPagesAreSoundRoff) {
  if (std::system("command -v groff > /dev/null 2>&1") != 0) GTEST_SKIP() << "no groff";
  ASSERT_EQ(ist({"manual", "-o", "man"}).exit_code, 0);
  for (const auto& page : std::filesystem::directory_iterator(folder_ / "man")) {
    const std::string command = "groff -man -Kutf8 -Tutf8 -ww -z '" + page.path().string() +
                                "' 2> '" + (folder_ / "warnings").string() + "'";
    EXPECT_EQ(std::system(command.c_str()), 0);
    EXPECT_EQ(read("warnings"), "") << page.path();
  }
}

TEST_F(Reference, BashCompletesCommandsOptionsAndValues) {
  write("completion.bash", ist({"completion", "bash"}).out);
  std::vector<std::string> all = commands();
  all.insert(all.end(), {"--help", "--version"});
  EXPECT_EQ(offered({"ist", ""}), all);
  EXPECT_EQ(offered({"ist", "ba"}), std::vector<std::string>{"bake"});
  EXPECT_EQ(offered({"ist", "bake", "--sp"}), std::vector<std::string>{"--spheres"});
  EXPECT_EQ(offered({"ist", "bake", "--device", "c"}), (std::vector<std::string>{"cpu", "cuda"}));
  EXPECT_EQ(offered({"ist", "bake", "--spheres", ""}), std::vector<std::string>{});
  EXPECT_EQ(offered({"ist", "bake", "-o", ""}), std::vector<std::string>{"files"});
  EXPECT_EQ(offered({"ist", "bake", "cu"}), std::vector<std::string>{"files"});
  EXPECT_EQ(offered({"ist", "completion", "z"}), std::vector<std::string>{"zsh"});
  EXPECT_EQ(offered({"ist", "bake", "--grid", "e"}), std::vector<std::string>{"explicit"});
  EXPECT_EQ(offered({"ist", "bake", "--up-axis", ""}), (std::vector<std::string>{"X", "Y", "Z"}));
  EXPECT_EQ(offered({"ist", "bake", "--keep-mesh", ""}), (std::vector<std::string>{"yes", "no"}));
  EXPECT_EQ(offered({"ist", "sample", "hollow"}), std::vector<std::string>{"hollow_sphere"});
  // An option of a group of options.
  EXPECT_EQ(offered({"ist", "query", "--poses"}), std::vector<std::string>{"--poses"});
}

TEST_F(Reference, OtherShellsTakeTheirScripts) {
  int tried = 0;
  for (const std::string shell : {"zsh", "fish"}) {
    write(shell, ist({"completion", shell}).out);
    EXPECT_NE(read(shell).find("bake"), std::string::npos);
    if (std::system(("command -v " + shell + " > /dev/null 2>&1").c_str()) != 0) continue;
    ++tried;
    const std::string command = shell + " -n '" + (folder_ / shell).string() + "'";
    EXPECT_EQ(std::system(command.c_str()), 0) << shell;
  }
  if (tried == 0) GTEST_SKIP() << "neither zsh nor fish is here to parse its script";
}

TEST_F(Reference, NothingIsColouredUnderNoColor) {
  const auto error = [&](const std::string& environment) {
    ist::testing::RunOptions options;
    options.terminal = true;
    options.environment = {"TERM=xterm", environment};
    return ist({"info", "none.ist"}, options).err;
  };
  EXPECT_NE(error("NO_COLOR=").find("\x1b["), std::string::npos);
  EXPECT_EQ(error("NO_COLOR=1").find("\x1b["), std::string::npos);
}

TEST_F(Reference, ASceneHoldsTheWholeTree) {
  for (const std::string measure : {"matched", "inner"}) {
    ASSERT_EQ(ist({"export", "cube.ist", "-o", "cube.glb", "--measure", measure}).exit_code, 0);
    const std::string bytes = read("cube.glb");
    const auto word = [&](std::size_t at) {
      std::uint32_t w = 0;
      std::memcpy(&w, bytes.data() + at, 4);
      return std::size_t{w};
    };
    ASSERT_EQ(bytes.substr(0, 4), "glTF");
    ASSERT_EQ(word(8), bytes.size());
    const nlohmann::json scene = nlohmann::json::parse(bytes.substr(20, word(12)));
    ASSERT_EQ(20 + word(12) + 8 + word(20 + word(12)), bytes.size());
    // 100 spheres, 7 balls around them; the root's block is the third level's.
    const auto& nodes = scene.at("nodes");
    ASSERT_EQ(nodes.at(0).at("name"), "cube");
    ASSERT_EQ(nodes.at(0).at("children").size(), 2u);
    const auto& spheres = nodes.at(nodes.at(0).at("children")[0].get<std::size_t>());
    EXPECT_EQ(spheres.at("children").size(), 100u);
    EXPECT_EQ(nodes.at(nodes.at(0).at("children")[1].get<std::size_t>()).at("children").size(), 7u);
    EXPECT_EQ(nodes.size(), 1u + 2u + 107u);
    EXPECT_EQ(scene.at("materials").size(), 2u);
    // The spheres are those of the table, in another order.
    ASSERT_EQ(ist({"export", "cube.ist", "-o", "cube.json"}).exit_code, 0);
    const nlohmann::json table = nlohmann::json::parse(read("cube.json"));
    double volume = 0, expected = 0;
    for (const auto& i : spheres.at("children")) {
      const double r = nodes.at(i.get<std::size_t>()).at("scale")[0];
      volume += r * r * r;
    }
    for (const auto& row : table.at("spheres")) {
      const double r = row.at(measure == "inner" ? 3 : 7);
      expected += r * r * r;
    }
    EXPECT_NEAR(volume, expected, 1e-6 * expected);
    // Triangles face outward, on the unit ball.
    const char* const data = bytes.data() + 20 + word(12) + 8;
    const auto& views = scene.at("bufferViews");
    std::vector<float> at(views[0].at("byteLength").get<std::size_t>() / 4);
    std::memcpy(at.data(), data, at.size() * 4);
    std::vector<std::uint16_t> corners(views[1].at("byteLength").get<std::size_t>() / 2);
    std::memcpy(corners.data(), data + at.size() * 4, corners.size() * 2);
    ASSERT_EQ(corners.size(), 3u * 320u);
    double ball = 0;  // six times its volume
    for (std::size_t t = 0; t < corners.size(); t += 3) {
      double p[3][3];
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t k = 0; k < 3; ++k)
          p[c][k] = static_cast<double>(at[3u * corners[t + c] + k]);
      const double six = p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) +
                         p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
                         p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
      EXPECT_GT(six, 0);
      ball += six;
    }
    EXPECT_NEAR(ball / 6, 4.19, 0.15);
  }
  const Outcome wrong = ist({"export", "cube.ist", "-o", "cube.csv", "--measure", "inner"});
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_NE(wrong.err.find("--measure is for .glb"), std::string::npos) << wrong.err;
}

}  // namespace
