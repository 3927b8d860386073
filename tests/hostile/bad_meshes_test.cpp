#include <gtest/gtest.h>
#include <sys/resource.h>

#include <nlohmann/json.hpp>

#include "cli/program.h"
#include "support/mesh_table.h"
#include "support/sanitizers.h"
#include "support/shared_data.h"

// Every broken and tricky mesh of the shared data, baked by the real program. bad_meshes.csv says
// what happens to each: `exit_code`, the solid's `volume` where one results (six digits), and in
// `message` the fragments, parted by " | ", that the errors or warnings about the file must hold.

namespace ist::testing {
namespace {

/// The committed table by file name.
const std::map<std::string, MeshRow>& table() {
  static const std::map<std::string, MeshRow> rows = [] {
    std::map<std::string, MeshRow> result;
    for (const MeshRow& row : read_mesh_table(IST_SOURCE_DIR "/tests/hostile/bad_meshes.csv"))
      result[row.at("file")] = row;
    return result;
  }();
  return rows;
}

std::vector<std::string> file_names() {
  std::vector<std::string> names;
  for (const auto& [file, row] : table()) names.push_back(file);
  return names;
}

/// [bytes] Memory that the program may use beyond that of `--version` and a share per byte of the
/// file: to refuse it, and to pack 100 spheres. The reader of glTF uses most per byte, since its
/// JSON becomes a document.
constexpr std::size_t kRefusing = std::size_t{12} << 20, kPacking = std::size_t{36} << 20;
constexpr std::size_t kBytesPerByte = 30;
constexpr double kMostSeconds = 20;

std::vector<std::string> fragments_of(const std::string& text) {
  const std::string bar = " | ";
  std::vector<std::string> fragments;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(bar, begin), text.size());
    fragments.push_back(text.substr(begin, end - begin));
    begin = end + bar.size();
  }
  return fragments;
}

/// The lines of stderr that `start` with a level and the file's name, without those.
std::string said_about(const std::string& err, const std::string& start) {
  std::string said;
  for (const std::string& line : lines_of(err))
    if (line.rfind(start, 0) == 0) said += line.substr(start.size()) + "\n";
  return said;
}

class BadMesh : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    IST_NEEDS_SHARED("meshes/bad/MESHES.csv");
    std::string pattern = (std::filesystem::temp_directory_path() / "ist_bad_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    mesh_ = std::filesystem::absolute(shared_path("meshes/bad/" + GetParam())).string();
  }
  void TearDown() override {
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }

  /// Bakes the mesh to out.ist.
  Outcome bake() const {
    RunOptions options;
    options.stop_after = kMostSeconds;
    // A refused file is refused before any thread starts: nothing else needs address space.
    if (row_.at("expect") == "reject" && !kSanitized)
      options.in_child = [] {
        const rlimit limit = {std::size_t{256} << 20, std::size_t{256} << 20};
        setrlimit(RLIMIT_AS, &limit);
      };
    return run_ist(folder_,
                   {"bake", mesh_, "-o", "out.ist", "--spheres", "100", "--threads", "2",
                    "--device", "cpu", "--json"},
                   options);
  }

  const MeshRow& row_ = table().at(GetParam());
  std::filesystem::path folder_;
  std::string mesh_;
};

TEST_P(BadMesh, EndsAsTheTableSays) {
  const Outcome outcome = bake();
  const bool baked = row_.at("exit_code") == "0";
  ASSERT_EQ(std::to_string(outcome.exit_code), row_.at("exit_code")) << outcome.err;
  const std::string said = said_about(
      outcome.err, std::string("ist: ") + (baked ? "warning: " : "error: ") + mesh_ + ": ");
  for (const std::string& fragment : fragments_of(row_.at("message")))
    EXPECT_NE(said.find(fragment), std::string::npos) << fragment << "\nis not in\n" << outcome.err;
  for (const char c : outcome.err) EXPECT_TRUE(c == '\n' || (c & 0xe0) != 0) << outcome.err;

  if (baked) {
    const nlohmann::json json = nlohmann::json::parse(outcome.out);
    const double volume = json.at("volume");
    EXPECT_GT(volume, 0);
    EXPECT_NEAR(volume / number(row_, "volume"), 1, 5e-6);
    EXPECT_EQ(json.at("spheres"), 100);
    const Outcome check = run_ist(folder_, {"check", "out.ist", "--mesh", mesh_});
    EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
  } else {
    EXPECT_EQ(outcome.out, "");
    EXPECT_TRUE(std::filesystem::is_empty(folder_));
  }
  if (!kSanitized) {
    EXPECT_LE(outcome.peak_memory, run_ist(folder_, {"--version"}).peak_memory +
                                       (baked ? kPacking : kRefusing) +
                                       kBytesPerByte * std::filesystem::file_size(mesh_));
  }
}

std::string name_of(const ::testing::TestParamInfo<std::string>& info) {
  std::string name = info.param;
  for (char& c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  return name;
}

INSTANTIATE_TEST_SUITE_P(Hostile, BadMesh, ::testing::ValuesIn(file_names()), name_of);

// A table that forgets a file, or asks less of one than the data does, vouches for nothing.
TEST(BadMeshTable, NamesEveryMeshAndMeetsItsExpectation) {
  IST_NEEDS_SHARED("meshes/bad/MESHES.csv");
  std::size_t meshes = 0;
  for (const MeshRow& row : read_mesh_table(shared_path("meshes/bad/MESHES.csv").string())) {
    if (row.at("format") == "urdf") continue;  // robots, not meshes
    SCOPED_TRACE(row.at("file"));
    ++meshes;
    ASSERT_TRUE(table().contains(row.at("file")));
    const MeshRow& promised = table().at(row.at("file"));
    EXPECT_EQ(promised.at("expect"), row.at("expect"));
    const bool baked = promised.at("exit_code") == "0";
    EXPECT_EQ(promised.at("volume").empty(), !baked);
    if (row.at("expect") == "reject") {
      EXPECT_FALSE(baked);
    }
    if (row.at("expect") == "accept") {
      EXPECT_TRUE(baked);
    } else {
      EXPECT_FALSE(promised.at("message").empty());
    }
  }
  EXPECT_EQ(table().size(), meshes);
}

}  // namespace
}  // namespace ist::testing
