#include <sys/mount.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdlib>
#include <random>
#include <regex>
#include <thread>

#include "library/library_folder.h"

// External faults of a bake with a cache: killed, a full disk, damage, others on the same
// folder. Nothing is lost, nothing wrong, and nothing is baked twice but what was in flight.

namespace ist::testing {
namespace {

class Cache : public LibraryFolder {
 protected:
  /// Assets that the log says were baked.
  static std::size_t baked_in(const std::string& log) {
    const std::regex line("\\] [^ ]+: baked in ");
    return static_cast<std::size_t>(
        std::distance(std::sregex_iterator(log.begin(), log.end(), line), {}));
  }
  nlohmann::json counts(const std::vector<std::string>& more = {"--cache", "cache"}) const {
    return summary_of("out", more).at("counts");
  }
  nlohmann::json cache_of(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"cache", "cache", "--json"});
    const Outcome outcome = ist(more);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  }
};

TEST_F(Cache, WhatDidNotChangeIsNotBakedAgain) {
  EXPECT_EQ(counts().at("baked"), 5);
  const auto files = files_in("out");
  EXPECT_EQ(counts().at("cached"), 5);
  std::filesystem::remove_all(folder_ / "out");
  EXPECT_EQ(counts().at("cached"), 5);
  EXPECT_TRUE(files_in("out") == files);
  // Another name or place of the same mesh is the same asset, a byte of the mesh another one.
  std::filesystem::rename(folder_ / "meshes/cube.obj", folder_ / "meshes/dice.obj");
  EXPECT_EQ(counts().at("cached"), 5);
  EXPECT_TRUE(read("out/dice.ist") == files.at("cube.ist"));
  write("meshes/dice.obj", read("meshes/dice.obj") + "#");
  EXPECT_EQ(counts().at("baked"), 1);
  // So are other settings.
  std::string manifest = read("library.toml");
  manifest.replace(manifest.find("0.001"), 5, "0.002");
  write("library.toml", manifest);
  EXPECT_EQ(counts().at("baked"), 1);
}

TEST_F(Cache, WarningsAreThoseOfTheBake) {
  write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n");
  write("open.toml", "[[asset]]\nmesh = 'open.obj'\nspheres = 9\nrepair = true\n");
  const auto warnings = [&](const std::string& status) {
    const Outcome outcome = bake("out", {"--cache", "cache", "--json"}, {}, "open.toml");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    const nlohmann::json asset = nlohmann::json::parse(outcome.out).at("assets")[0];
    EXPECT_EQ(asset.at("status"), status);
    return asset.at("warnings");
  };
  const nlohmann::json first = warnings("baked");
  EXPECT_FALSE(first.empty());
  EXPECT_EQ(warnings("cached"), first);
}

TEST_F(Cache, TheEnvironmentMayNameIt) {
  RunOptions options;
  options.environment = {"IST_CACHE=elsewhere"};
  ASSERT_EQ(bake("out", {}, options).exit_code, 0);
  EXPECT_EQ(entries_in("elsewhere"), 5u);
  ASSERT_EQ(bake("out", {"--cache", "cache"}, options).exit_code, 0);
  EXPECT_EQ(entries_in("cache"), 5u);
  options.environment = {"IST_CACHE="};
  EXPECT_EQ(bake("out", {}, options).exit_code, 0);
}

TEST_F(Cache, ADamagedEntryIsFoundAndBakedAgain) {
  EXPECT_EQ(counts().at("baked"), 5);
  const auto files = files_in("out");
  std::mt19937 random(5);
  int i = 0;
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder_ / "cache")) {
    if (!file.is_regular_file()) continue;
    const std::string name = std::filesystem::relative(file.path(), folder_).string();
    std::string bytes = read(name);
    if (i % 3 == 0) bytes[random() % bytes.size()] ^= 0x10;
    if (i % 3 == 1) bytes.resize(random() % bytes.size());
    if (i % 3 == 2) bytes += 'x';
    ++i;
    write(name, bytes);
  }
  ASSERT_EQ(i, 5);
  std::filesystem::remove_all(folder_ / "out");
  const nlohmann::json summary = summary_of("out", {"--cache", "cache"});
  EXPECT_EQ(summary.at("counts").at("baked"), 5);
  for (const nlohmann::json& asset : summary.at("assets"))
    EXPECT_NE(asset.at("warnings").dump().find("the cache entry is damaged"), std::string::npos)
        << asset;
  EXPECT_TRUE(files_in("out") == files);
  EXPECT_EQ(counts().at("cached"), 5);
}

TEST_F(Cache, ALimitKeepsWhatWasUsedLast) {
  EXPECT_EQ(counts().at("baked"), 5);
  const std::uint64_t bytes = cache_of().at("bytes");
  write("cache/README", "mine");
  // cube.obj is requested again, much later than the rest.
  using namespace std::chrono_literals;
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder_ / "cache"))
    if (file.is_regular_file())
      std::filesystem::last_write_time(file.path(),
                                       std::filesystem::file_time_type::clock::now() - 2h);
  write("cube.toml", "[[asset]]\nmesh = \"meshes/cube.obj\"\nspheres = 40\n");
  ASSERT_EQ(bake("out", {"--cache", "cache"}, {}, "cube.toml").exit_code, 0);
  std::string left;  // what a program that was killed two hours ago left, and one that writes now
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder_ / "cache"))
    if (file.path().extension() == ".entry") left = std::filesystem::relative(file.path(), folder_);
  write(left + ".17.3", "part");
  std::filesystem::last_write_time(folder_ / (left + ".17.3"),
                                   std::filesystem::file_time_type::clock::now() - 2h);
  write(left + ".18.0", "part");
  EXPECT_EQ(cache_of().at("left_over").at("files"), 2);
  EXPECT_EQ(cache_of({"--prune"}).at("pruned").at("files"), 1);
  EXPECT_EQ(cache_of().at("entries"), 5);

  const std::uint64_t most = bytes / 3;
  const nlohmann::json pruned = cache_of({"--prune", "--max-size", std::to_string(most)});
  EXPECT_LE(pruned.at("bytes"), most);
  EXPECT_GE(pruned.at("entries"), 1);
  ASSERT_EQ(bake("out", {"--cache", "cache"}, {}, "cube.toml").exit_code, 0);
  EXPECT_NE(bake("out", {"--cache", "cache"}, {}, "cube.toml").err.find("cube: cached"),
            std::string::npos);
  EXPECT_EQ(read("cache/README"), "mine");
  EXPECT_EQ(cache_of({"--prune", "--max-size", "0"}).at("entries"), 0);

  // A bake keeps to a limit too.
  EXPECT_EQ(counts({"--cache", "cache", "--cache-size", std::to_string(most)}).at("baked"), 5);
  EXPECT_LE(cache_of().at("bytes"), most);
  EXPECT_EQ(ist({"cache", "nowhere"}).exit_code, 1);
  EXPECT_EQ(ist({"cache", "cache", "--max-size", "1G"}).exit_code, 2);
  EXPECT_EQ(ist({"cache", "cache", "--prune", "--max-size", "1X"}).exit_code, 2);
}

TEST_F(Cache, SeveralProcessesShareIt) {
  ASSERT_EQ(bake("expected").exit_code, 0);
  for (int round = 0; round < 2; ++round) {
    std::vector<int> codes(3, -1);
    std::vector<std::thread> bakes;
    for (std::size_t k = 0; k < codes.size(); ++k)
      bakes.emplace_back([&, k] {
        codes[k] = bake("out" + std::to_string(k), {"--cache", "cache", "--quiet"}).exit_code;
      });
    for (std::thread& thread : bakes) thread.join();
    EXPECT_EQ(codes, std::vector<int>(3, 0));
    for (int k = 0; k < 3; ++k)
      EXPECT_TRUE(files_in("out" + std::to_string(k)) == files_in("expected"));
    EXPECT_EQ(cache_of().at("entries"), 5);
    EXPECT_EQ(cache_of().at("left_over").at("files"), 0);
  }
  EXPECT_EQ(counts().at("cached"), 5);
}

TEST_F(Cache, AFullDiskOfTheCacheIsAWarning) {
  std::filesystem::create_directory(folder_ / "cache");
  if (mount("none", (folder_ / "cache").c_str(), "tmpfs", 0, "size=100k") != 0)
    GTEST_SKIP() << "a small file system cannot be mounted here";
  const nlohmann::json summary = summary_of("out", {"--cache", "cache"});
  EXPECT_EQ(summary.at("counts").at("baked"), 5);
  EXPECT_EQ(files_in("out").size(), 5u);
  EXPECT_NE(summary.dump().find("not stored in the cache: "), std::string::npos) << summary;
  EXPECT_NE(summary.dump().find("No space left"), std::string::npos) << summary;
  EXPECT_EQ(cache_of().at("left_over").at("files"), 0);
  const auto files = files_in("out");
  EXPECT_EQ(counts().at("failed"), 0);
  EXPECT_TRUE(files_in("out") == files);
  umount((folder_ / "cache").c_str());
}

TEST_F(Cache, AFullDiskIsAnErrorOfEachAsset) {
  RunOptions options;
  options.in_child = [] {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit small = {5'000, 5'000};
    setrlimit(RLIMIT_FSIZE, &small);
  };
  const Outcome outcome = bake("out", {"--cache", "cache"}, options);
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_NE(outcome.err.find("out/cube.ist: cannot write: "), std::string::npos) << outcome.err;
  EXPECT_TRUE(files_in("out").empty());
  EXPECT_EQ(entries_in("cache"), 0u);
  EXPECT_EQ(cache_of().at("left_over").at("files"), 0);
  EXPECT_EQ(counts().at("baked"), 5);
}

/// IST_KILLS of them, or a dozen. Each run goes on where the one before was killed; once one comes
/// to its end, all begins again.
TEST_F(Cache, KilledAtRandomMoments) {
  const char* const asked = std::getenv("IST_KILLS");
  const int kills = asked != nullptr ? std::atoi(asked) : 12;
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(bake("expected", {"--cache", "first"}).exit_code, 0);
  const std::chrono::duration<double> whole = std::chrono::steady_clock::now() - start;
  const auto expected = files_in("expected");
  ASSERT_EQ(expected.size(), 5u);
  std::mt19937_64 random(6);
  int left_over = 0, killed = 0, wholes = 0;
  for (bool ended = false; killed < kills || !ended;) {
    const std::size_t before = entries_in("cache");
    RunOptions options;
    if (killed < kills)
      options.stop_after =
          std::uniform_real_distribution<double>(0.01, 1.2)(random) * whole.count();
    const Outcome outcome = bake("out", {"--cache", "cache", "--jobs", "2"}, options);
    ended = outcome.exit_code == 0;
    ASSERT_TRUE(ended || outcome.exit_code == 128 + SIGKILL) << outcome.err;
    ASSERT_EQ(outcome.err.find("damaged"), std::string::npos) << outcome.err;
    const std::size_t after = entries_in("cache");
    // Entries in the cache stay there, and are not baked again.
    ASSERT_GE(after, before);
    ASSERT_LE(baked_in(outcome.err), after - before) << outcome.err;
    for (const auto& [name, bytes] : files_in("out")) {
      if (expected.count(name) != 0) {
        ASSERT_TRUE(bytes == expected.at(name)) << name;
      } else {  // between two system calls: see write_atomically()
        ++left_over;
        std::filesystem::remove(folder_ / "out" / name);
      }
    }
    killed += ended ? 0 : 1;
    if (!ended) continue;
    ++wholes;
    ASSERT_EQ(baked_in(outcome.err), 5 - before) << outcome.err;
    ASSERT_TRUE(files_in("out") == expected);
    ASSERT_EQ(counts().at("cached"), 5);
    std::filesystem::remove_all(folder_ / "out");
    std::filesystem::remove_all(folder_ / "cache");
  }
  EXPECT_LE(left_over, 1 + kills / 50);
  std::printf("%d kills, %d runs to the end\n", killed, wholes);
}

}  // namespace
}  // namespace ist::testing
